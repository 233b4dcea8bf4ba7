// SPDX-License-Identifier: MIT
#include "daemon/segments.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <tuple>
#include <utility>
#include <vector>

#include "compensation/text_number.hpp"

namespace prism::daemon {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kStampChars = 16;  // 20261121T091100Z

struct Segment {
  fs::path path;
  std::string stamp;  // and the number of a later one in the same second: 20261121T091100Z-2
  std::int64_t bytes;
};

// "-10" after "-2": the longer one is the later one.
auto age(const Segment& segment) {
  return std::tuple(segment.stamp.substr(0, kStampChars), segment.stamp.size(), segment.stamp);
}

bool is_stamp(const std::string& text) {
  return text.size() >= kStampChars && text[8] == 'T' && text[15] == 'Z' &&
         std::all_of(text.begin(), text.begin() + 8, [](char c) { return c >= '0' && c <= '9'; });
}

// Oldest first.
std::vector<Segment> list_segments(const std::string& directory, const std::string& name,
                                   const std::string& extension) {
  std::vector<Segment> segments;
  std::error_code error;
  for (fs::directory_iterator entry(directory, error), end; !error && entry != end; entry.increment(error)) {
    const std::string file = entry->path().filename().string();
    if (file.rfind(name + "-", 0) != 0 || entry->path().extension() != extension) continue;
    std::string stamp = entry->path().stem().string().substr(name.size() + 1);
    if (!is_stamp(stamp)) continue;
    std::error_code unknown;
    const std::uintmax_t bytes = entry->file_size(unknown);
    segments.push_back({entry->path(), std::move(stamp), unknown ? 0 : static_cast<std::int64_t>(bytes)});
  }
  std::sort(segments.begin(), segments.end(), [](const Segment& a, const Segment& b) { return age(a) < age(b); });
  return segments;
}

bool remove(const Segment& segment) {
  std::error_code error;
  return fs::remove(segment.path, error) && !error;
}

}  // namespace

bool disk_is_full(int error) { return error == ENOSPC || error == EDQUOT; }

Segments::Segments(config::SegmentSettings settings, std::string name, std::string extension)
    : settings_(std::move(settings)), name_(std::move(name)), extension_(std::move(extension)) {}

bool Segments::begins_new(std::int64_t second, std::int64_t bytes) {
  const std::int64_t period = second / settings_.max_age_s - (second % settings_.max_age_s < 0 ? 1 : 0);
  if (period == period_ && bytes <= settings_.max_bytes) return false;
  period_ = period;
  return true;
}

Result<NewSegment> Segments::make(std::int64_t second) {
  std::error_code error;
  fs::create_directories(settings_.directory, error);
  if (error) return refuse(settings_.directory, "cannot be made: " + error.message());
  const std::string stem = fmt::format("{}/{}-{}", settings_.directory, name_, utc_file_text(second));
  for (int number = 1;;) {
    NewSegment made{-1, number == 1 ? stem + extension_ : fmt::format("{}-{}{}", stem, number, extension_)};
    made.descriptor = ::open(made.path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_APPEND | O_CLOEXEC, 0644);
    if (made.descriptor >= 0) {
      current_ = made.path;
      delete_old(second);
      return made;
    }
    const int why = errno;
    if (why == EEXIST) {
      ++number;
    } else if (!disk_is_full(why) || !make_room()) {
      return refuse(made.path, std::string("cannot be created: ") + std::strerror(why));
    }
  }
}

void Segments::delete_old(std::int64_t second) {
  const std::vector<Segment> segments = list_segments(settings_.directory, name_, extension_);
  const std::string oldest_kept = utc_file_text(second - settings_.keep_days * 86400);
  std::int64_t total = 0;
  for (const Segment& segment : segments) total += segment.bytes;
  for (const Segment& segment : segments) {
    if (total <= settings_.keep_bytes && segment.stamp >= oldest_kept) break;
    if (segment.path != current_ && remove(segment)) total -= segment.bytes;
  }
}

bool Segments::make_room() {
  if (!settings_.delete_when_full) return false;
  const std::vector<Segment> segments = list_segments(settings_.directory, name_, extension_);
  return std::any_of(segments.begin(), segments.end(),
                     [this](const Segment& segment) { return segment.path != current_ && remove(segment); });
}

bool Segments::in_place(int descriptor) const {
  struct stat open {
  }, there{};
  return ::fstat(descriptor, &open) == 0 && ::stat(current_.c_str(), &there) == 0 && open.st_dev == there.st_dev &&
         open.st_ino == there.st_ino;
}

}  // namespace prism::daemon
