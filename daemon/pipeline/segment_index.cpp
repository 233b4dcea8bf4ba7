// SPDX-License-Identifier: MIT
#include "daemon/pipeline/segment_index.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/escape.hpp"
#include "base/file.hpp"

namespace prism::pipeline {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr const char* kFormat = "prism-segments";
constexpr std::uint64_t kStaleLines = 10'000;  // above: rewrite the file without deleted segments

std::string new_id() {
  std::array<std::uint8_t, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) return {};
  return fmt::format("{:02x}", fmt::join(bytes, ""));
}

std::uint64_t unsigned_of(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number_unsigned() ? found->get<std::uint64_t>() : 0;
}

std::string word(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

}  // namespace

void SegmentIndex::refresh(const std::vector<std::string>& files) {
  if (id_.empty() || !in_place()) {
    if (!read()) begin();
  }
  for (const std::string& file : files) {
    if (number(file) == 0) made(file);
  }
  compact();
}

std::uint64_t SegmentIndex::number(const std::string& file) const {
  const auto found = numbers_.find(file);
  return found == numbers_.end() ? 0 : found->second;
}

std::uint64_t SegmentIndex::rows(const std::string& file) const {
  const auto found = entries_.find(number(file));
  return found == entries_.end() ? 0 : found->second.rows;
}

std::vector<std::string> SegmentIndex::files() const {
  std::vector<std::string> files;
  for (const auto& [number, entry] : entries_) files.push_back(entry.file);
  return files;
}

void SegmentIndex::made(const std::string& file) {
  put({{"made", next_}, {"file", file}});
  take_number(next_, file, 0);
}

void SegmentIndex::ended(const std::string& file, std::uint64_t rows) {
  const auto found = entries_.find(number(file));
  if (found == entries_.end()) return;
  found->second.rows = rows;
  put({{"ended", found->first}, {"rows", rows}});
}

void SegmentIndex::deleted(const std::string& file, std::uint64_t rows) {
  const std::uint64_t gone = number(file);
  if (gone == 0) return;
  put({{"deleted", gone}, {"rows", rows}});
  forget(gone, rows);
}

void SegmentIndex::take_number(std::uint64_t number, const std::string& file, std::uint64_t rows) {
  entries_[number] = {file, rows};
  numbers_[file] = number;
  next_ = std::max(next_, number + 1);
}

void SegmentIndex::forget(std::uint64_t number, std::uint64_t rows) {
  ++deleted_segments_;
  deleted_rows_ += rows;
  stale_lines_ += 3;
  const auto entry = entries_.find(number);
  if (const auto name = numbers_.find(entry->second.file); name->second == number) numbers_.erase(name);
  entries_.erase(entry);
}

bool SegmentIndex::in_place() const {
  struct stat there {};
  return ::stat(path_.c_str(), &there) == 0 && there.st_dev == device_ && there.st_ino == inode_;
}

void SegmentIndex::remember_file() {
  struct stat there {};
  if (::stat(path_.c_str(), &there) == 0) device_ = there.st_dev, inode_ = there.st_ino;
}

// Reads complete lines; skips invalid ones and one that a power cut truncated.
bool SegmentIndex::read() {
  const Result<std::string> text = read_text_file(path_, kMaxModelBytes);
  *this = SegmentIndex(path_);
  if (!text) return false;
  const std::size_t last = text->rfind('\n') + 1;
  for (std::size_t begin = 0; begin < last;) {
    const std::size_t end = text->find('\n', begin);
    if (!take_line(text->substr(begin, end - begin)) && id_.empty()) return false;
    begin = end + 1;
  }
  if (id_.empty()) return false;
  if (last < text->size()) waiting_.assign(1, '\n');  // ends the truncated line
  remember_file();
  return true;
}

bool SegmentIndex::take_line(const std::string& line) {
  const json object = json::parse(line, nullptr, false);
  if (!object.is_object()) return false;
  if (word(object, "format") == kFormat && unsigned_of(object, "version") == 1) {
    id_ = word(object, "id");
    next_ = std::max<std::uint64_t>(unsigned_of(object, "next"), 1);
    deleted_segments_ = unsigned_of(object, "deleted_segments");
    deleted_rows_ = unsigned_of(object, "deleted_rows");
    return true;
  }
  if (const std::uint64_t made = unsigned_of(object, "made"); made > 0) {
    take_number(made, word(object, "file"), unsigned_of(object, "rows"));
    return true;
  }
  const std::uint64_t gone = unsigned_of(object, "deleted");
  const auto entry = entries_.find(std::max(unsigned_of(object, "ended"), gone));
  if (entry == entries_.end()) return false;
  entry->second.rows = unsigned_of(object, "rows");
  if (gone > 0) forget(gone, entry->second.rows);
  return true;
}

void SegmentIndex::begin() {
  *this = SegmentIndex(path_);
  id_ = new_id();
  compact();
}

// Rewrites the index: when it is created, and when most lines are of deleted segments.
void SegmentIndex::compact() {
  if (inode_ != 0 && stale_lines_ < kStaleLines) return;
  const ordered_json head = {{"format", kFormat},
                             {"version", 1},
                             {"id", id_},
                             {"next", next_},
                             {"deleted_segments", deleted_segments_},
                             {"deleted_rows", deleted_rows_}};
  std::string text = json_text(head) + "\n";
  for (const auto& [number, entry] : entries_)
    text += json_text(ordered_json{{"made", number}, {"file", entry.file}, {"rows", entry.rows}}) + "\n";
  struct stat link {};
  if (::lstat(path_.c_str(), &link) == 0 && S_ISLNK(link.st_mode))
    ::unlink(path_.c_str());  // it could point to any file
  if (!write_text_file(path_, text)) return;
  waiting_.clear();
  stale_lines_ = 0;
  remember_file();
}

void SegmentIndex::put(const ordered_json& line) {
  waiting_ += json_text(line) + "\n";
  if (inode_ == 0) return;  // not created yet: compact() retries with all entries
  const int file = ::open(path_.c_str(), O_WRONLY | O_APPEND | O_NOFOLLOW | O_CLOEXEC);
  if (file < 0) return;
  const ssize_t written = ::write(file, waiting_.data(), waiting_.size());
  if (written > 0) waiting_.erase(0, static_cast<std::size_t>(written));
  ::close(file);
}

}  // namespace prism::pipeline
