// SPDX-License-Identifier: MIT
#include "daemon/pipeline/segment_index.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/escape.hpp"
#include "base/file.hpp"

namespace prism::pipeline {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr const char* kFormat = "prism-segments";
constexpr std::uint64_t kStaleLines = 10'000;     // above: rewrite the file without deleted segments
constexpr std::int64_t kClockEvery_s = 3600;      // so much of the measured time a power cut may lose
constexpr std::int64_t kMaxClockStep_s = 86'400;  // between two lines; a larger step is damage and makes no segment old

std::string new_id() {
  std::array<std::uint8_t, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) return {};
  return fmt::format("{:02x}", fmt::join(bytes, ""));
}

std::uint64_t unsigned_of(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number_unsigned() ? found->get<std::uint64_t>() : 0;
}

std::int64_t seconds_of(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number_integer() ? found->get<std::int64_t>() : 0;
}

std::string word(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

}  // namespace

void SegmentIndex::refresh(const std::vector<std::string>& files) {
  if (id_.empty() || !in_place()) {
    if (!read()) {
      const bool exists = FileId::of(path_).has_value();
      begin();
      was_damaged_ = exists;
    }
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
  put({{"made", next_}, {"file", file}, {"clock_s", clock_s_}});
  take_number(next_, file, 0, clock_s_);
}

void SegmentIndex::ended(const std::string& file, std::uint64_t rows) {
  const auto found = entries_.find(number(file));
  if (found == entries_.end()) return;
  found->second.rows = rows;
  found->second.clock_s = clock_s_;
  put({{"ended", found->first}, {"rows", rows}, {"clock_s", clock_s_}});
}

void SegmentIndex::found(const std::string& file, std::uint64_t rows) {
  const auto found = entries_.find(number(file));
  if (found == entries_.end()) return;
  found->second.rows = rows;
  put({{"ended", found->first}, {"rows", rows}});
}

void SegmentIndex::deleting(const SegmentDeletion& deletion) {
  const std::uint64_t begun = number(deletion.file);
  if (begun == 0 || !deleting_.try_emplace(begun, deletion).second) return;
  put({{"deleting", begun}, {"rows", deletion.rows}, {"before_s", deletion.before_s}}, true);
}

void SegmentIndex::deleted(const SegmentDeletion& deletion) {
  const std::uint64_t gone = number(deletion.file);
  if (gone == 0) return;
  put({{"deleted", gone}, {"rows", deletion.rows}, {"before_s", deletion.before_s}});
  forget(gone, deletion.rows, deletion.before_s);
}

std::vector<SegmentDeletion> SegmentIndex::interrupted(const std::vector<std::string>& present) const {
  std::vector<SegmentDeletion> gone;
  for (const auto& [begun, deletion] : deleting_) {
    const bool is_there = std::find(present.begin(), present.end(), deletion.file) != present.end();
    if (!is_there && number(deletion.file) == begun) gone.push_back(deletion);
  }
  return gone;
}

void SegmentIndex::settle(const std::vector<std::string>& present) {
  for (const SegmentDeletion& gone : interrupted(present)) forget(number(gone.file), gone.rows, gone.before_s);
}

void SegmentIndex::advance(std::int64_t seconds) {
  clock_s_ += std::max<std::int64_t>(seconds, 0);
  if (clock_s_ - written_clock_s_ < kClockEvery_s || id_.empty() || !waiting_.empty()) return;
  put({{"clock_s", clock_s_}});
  written_clock_s_ = clock_s_;
  ++stale_lines_;
}

std::int64_t SegmentIndex::age_s(const std::string& file) const {
  const auto found = entries_.find(number(file));
  return found == entries_.end() ? 0 : std::max<std::int64_t>(clock_s_ - found->second.clock_s, 0);
}

// Clocks increase with the numbers: a smaller one is damage and makes no segment older than the one before it.
void SegmentIndex::take_number(std::uint64_t number, const std::string& file, std::uint64_t rows,
                               std::int64_t clock_s) {
  const auto next = entries_.lower_bound(number);
  const std::int64_t least = next == entries_.begin() ? 0 : std::prev(next)->second.clock_s;
  entries_[number] = {file, rows, std::clamp(clock_s, least, std::max(least, clock_s_))};
  numbers_[file] = number;
  next_ = std::max(next_, number + 1);
}

void SegmentIndex::forget(std::uint64_t number, std::uint64_t rows, std::int64_t before_s) {
  ++deleted_segments_;
  deleted_rows_ += rows;
  if (before_s != 0) deleted_before_s_ = before_s;
  stale_lines_ += 4;
  deleting_.erase(number);
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

bool SegmentIndex::take_head(const json& object) {
  if (word(object, "format") != kFormat || unsigned_of(object, "version") != 1) return false;
  id_ = word(object, "id");
  next_ = std::max<std::uint64_t>(unsigned_of(object, "next"), 1);
  deleted_segments_ = unsigned_of(object, "deleted_segments");
  deleted_rows_ = unsigned_of(object, "deleted_rows");
  deleted_before_s_ = seconds_of(object, "deleted_before_s");
  clock_s_ = written_clock_s_ = std::clamp<std::int64_t>(seconds_of(object, "clock_s"), 0, INT32_MAX);
  return true;
}

void SegmentIndex::take_clock(std::int64_t seconds) {
  if (seconds > clock_s_) clock_s_ += std::min(seconds - clock_s_, kMaxClockStep_s);
  written_clock_s_ = clock_s_;
}

bool SegmentIndex::take_line(const std::string& line) {
  const json object = json::parse(line, nullptr, false);
  if (!object.is_object()) return false;
  if (take_head(object)) return true;
  const bool has_clock = object.contains("clock_s");
  if (has_clock) take_clock(seconds_of(object, "clock_s"));
  if (const std::uint64_t made = unsigned_of(object, "made"); made > 0) {
    take_number(made, word(object, "file"), unsigned_of(object, "rows"),
                has_clock ? seconds_of(object, "clock_s") : clock_s_);
    return true;
  }
  const std::uint64_t gone = unsigned_of(object, "deleted"), begun = unsigned_of(object, "deleting");
  const auto entry = entries_.find(std::max({unsigned_of(object, "ended"), gone, begun}));
  if (entry == entries_.end()) return has_clock;
  const std::uint64_t rows = unsigned_of(object, "rows");
  if (begun > 0) {
    deleting_[begun] = {entry->second.file, rows, seconds_of(object, "before_s")};
    return true;
  }
  entry->second.rows = rows;
  if (has_clock) entry->second.clock_s = clock_s_;
  if (gone > 0) forget(gone, rows, seconds_of(object, "before_s"));
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
                             {"deleted_rows", deleted_rows_},
                             {"deleted_before_s", deleted_before_s_},
                             {"clock_s", clock_s_}};
  std::string text = json_text(head) + "\n";
  for (const auto& [number, entry] : entries_)
    text += json_text(ordered_json{
                {"made", number}, {"file", entry.file}, {"rows", entry.rows}, {"clock_s", entry.clock_s}}) +
            "\n";
  struct stat link {};
  if (::lstat(path_.c_str(), &link) == 0 && S_ISLNK(link.st_mode))
    ::unlink(path_.c_str());  // it could point to any file
  if (!write_text_file(path_, text)) return;
  waiting_.clear();
  deleting_.clear();
  stale_lines_ = 0;
  written_clock_s_ = clock_s_;
  remember_file();
}

void SegmentIndex::put(const ordered_json& line, bool sync) {
  waiting_ += json_text(line) + "\n";
  if (inode_ == 0) return;  // not created yet: compact() retries with all entries
  const Descriptor file(::open(path_.c_str(), O_WRONLY | O_APPEND | O_NOFOLLOW | O_CLOEXEC));
  if (file.get() < 0) return;
  const ssize_t written = ::write(file.get(), waiting_.data(), waiting_.size());
  if (written > 0) waiting_.erase(0, static_cast<std::size_t>(written));
  if (sync) ::fdatasync(file.get());
}

}  // namespace prism::pipeline
