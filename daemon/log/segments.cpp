// SPDX-License-Identifier: MIT
#include "daemon/log/segments.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <tuple>
#include <utility>
#include <vector>

#include "base/file.hpp"
#include "base/text_number.hpp"
#include "base/time_scale.hpp"

namespace prism::log {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kStampChars = 16;       // 20261121T091100Z
constexpr std::int64_t kLookAfterNew_s = 10;  // a line that flaps begins a segment with each connection

// Order by name, for files without a number: "-10" after "-2", since the longer name is later.
auto age_by_name(const std::string& stamp) { return std::tuple(stamp.substr(0, kStampChars), stamp.size(), stamp); }

}  // namespace

bool disk_is_full(int error) { return error == ENOSPC || error == EDQUOT; }

Segments::Segments(config::LogSegmentSettings settings, std::string name, std::string extension, SegmentPolicy policy)
    : settings_(std::move(settings)),
      name_(std::move(name)),
      extension_(std::move(extension)),
      policy_(std::move(policy)),
      index_(fmt::format("{}/{}{}.index", settings_.directory, name_, extension_)) {}

bool Segments::begins_new(std::int64_t second, std::int64_t bytes) {
  const std::int64_t period = second / settings_.max_age_s - (second % settings_.max_age_s < 0 ? 1 : 0);
  if (period == period_ && bytes <= settings_.max_bytes) return false;
  period_ = period;
  return true;
}

Result<NewSegment> Segments::make(std::int64_t second) {
  std::error_code error;
  fs::create_directories(settings_.directory, error);
  if (error) return make_error(settings_.directory, "cannot be created: " + error.message());
  measure();
  if (!is_listed_ || !index_.in_place()) number_all();  // later segments are this object's own
  is_listed_ = true;
  const std::string stem = fmt::format("{}/{}-{}", settings_.directory, name_, utc_file_text(second));
  for (int number = 1;;) {
    NewSegment made{-1, number == 1 ? stem + extension_ : fmt::format("{}-{}{}", stem, number, extension_)};
    made.descriptor = ::open(made.path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_APPEND | O_CLOEXEC, 0644);
    if (made.descriptor >= 0) {
      ::flock(made.descriptor, LOCK_EX | LOCK_NB);
      current_ = made.path;
      index_.made(fs::path(current_).filename().string());
      next_look_s_ = std::min(next_look_s_, policy_.uptime_s() + scaled_s(kLookAfterNew_s));
      return made;
    }
    const int why = errno;
    if (why == EEXIST) {
      ++number;
    } else if (!disk_is_full(why) || !make_room()) {
      return make_error(made.path, std::string("cannot be created: ") + std::strerror(why));
    }
  }
}

std::map<std::string, std::string> Segments::number_all() {
  std::vector<std::string> files;
  std::map<std::string, std::string> paths;
  for (const Segment& segment : list()) {
    files.push_back(segment.file);
    paths[segment.file] = segment.path;
  }
  index_.refresh(files);
  if (index_.take_damage())
    report(pipeline::Severity::kWarning, "log_damaged",
           fmt::format(
               "{0}: {1}{2}.index: was damaged; there is a new one: positions of clients and ages of segments begin "
               "again",
               section(), name_, extension_));
  for (const pipeline::SegmentDeletion& deletion : index_.interrupted(files))
    record_deletion(deletion, fmt::format("{} (a power cut interrupted the deletion)", deletion.file));
  return paths;
}

std::vector<NumberedSegment> Segments::numbered() {
  std::error_code ignored;
  fs::create_directories(settings_.directory, ignored);
  const std::map<std::string, std::string> paths = number_all();
  std::vector<NumberedSegment> segments;
  for (const std::string& file : index_.files()) {
    const auto there = paths.find(file);
    segments.push_back({index_.number(file), file, there == paths.end() ? "" : there->second, index_.rows(file)});
  }
  return segments;
}

void Segments::ended(std::uint64_t rows) {
  measure();
  index_.ended(fs::path(current_).filename().string(), rows);
}

// The index's clock measures the time that prismd runs.
void Segments::measure() {
  const std::int64_t now_s = policy_.uptime_s();
  index_.advance(now_s - measured_s_.value_or(now_s));
  measured_s_ = now_s;
}

// Oldest first.
std::vector<Segments::Segment> Segments::list() const {
  std::vector<Segment> segments;
  std::error_code error;
  for (fs::directory_iterator entry(settings_.directory, error), end; !error && entry != end; entry.increment(error)) {
    const std::string file = entry->path().filename().string();
    if (file.rfind(name_ + "-", 0) != 0 || entry->path().extension() != extension_) continue;
    std::string stamp = entry->path().stem().string().substr(name_.size() + 1);
    if (!parse_utc_file_text(stamp)) continue;
    std::error_code unknown;
    const std::uintmax_t bytes = entry->file_size(unknown);
    segments.push_back(
        {entry->path().string(), file, std::move(stamp), unknown ? 0 : static_cast<std::int64_t>(bytes)});
  }
  const auto age = [this](const Segment& segment) {
    return std::tuple(index_.number(segment.file), age_by_name(segment.stamp));
  };
  std::sort(segments.begin(), segments.end(), [&](const Segment& a, const Segment& b) { return age(a) < age(b); });
  return segments;
}

bool Segments::in_place(int descriptor) const {
  struct stat open {
  }, there{};
  return ::fstat(descriptor, &open) == 0 && ::stat(current_.c_str(), &there) == 0 && open.st_dev == there.st_dev &&
         open.st_ino == there.st_ino;
}

}  // namespace prism::log
