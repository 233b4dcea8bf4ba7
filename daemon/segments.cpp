// SPDX-License-Identifier: MIT
#include "daemon/segments.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "compensation/text_number.hpp"

namespace prism::daemon {
namespace {

namespace fs = std::filesystem;

struct Segment {
  fs::path path;
  std::string stamp;  // 20261121T091100Z, then the number of a later one in the same second
  std::int64_t bytes;
};

// Oldest first. The stamp has a fixed width, so names sort by time.
std::vector<Segment> list_segments(const config::SegmentSettings& settings, const std::string& name,
                                   const std::string& extension) {
  constexpr std::size_t kStampLength = 16;
  std::vector<Segment> segments;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(settings.directory, error)) {
    const std::string file = entry.path().filename().string();
    if (file.rfind(name + "-", 0) != 0 || entry.path().extension() != extension) continue;
    const std::string stamp = entry.path().stem().string().substr(name.size() + 1);
    const bool ours = stamp.size() >= kStampLength && stamp[8] == 'T' && stamp[15] == 'Z' &&
                      std::all_of(stamp.begin(), stamp.begin() + 8, [](char c) { return c >= '0' && c <= '9'; });
    if (!ours) continue;
    const auto bytes = fs::file_size(entry.path(), error);
    segments.push_back({entry.path(), stamp, error ? 0 : static_cast<std::int64_t>(bytes)});
  }
  std::sort(segments.begin(), segments.end(), [](const Segment& a, const Segment& b) { return a.stamp < b.stamp; });
  return segments;
}

}  // namespace

bool SegmentClock::begins_new(std::int64_t second, std::int64_t bytes) {
  const std::int64_t period = second / settings_.max_age_s - (second % settings_.max_age_s < 0 ? 1 : 0);
  if (period == period_ && bytes <= settings_.max_bytes) return false;
  period_ = period;
  return true;
}

std::string segment_path(const config::SegmentSettings& settings, const std::string& name, const std::string& extension,
                         std::int64_t second) {
  const std::string stem = settings.directory + "/" + name + "-" + utc_file_text(second);
  std::string path = stem + extension;
  for (int number = 2; fs::exists(path); ++number) path = fmt::format("{}-{}{}", stem, number, extension);
  return path;
}

Result<void> make_segment_folder(const config::SegmentSettings& settings) {
  std::error_code error;
  fs::create_directories(settings.directory, error);
  if (error) return refuse(settings.directory, "cannot be made: " + error.message());
  return {};
}

std::vector<std::string> delete_old_segments(const config::SegmentSettings& settings, const std::string& name,
                                             const std::string& extension, const std::string& current,
                                             std::int64_t second) {
  const std::vector<Segment> segments = list_segments(settings, name, extension);
  const std::string oldest_kept = utc_file_text(second - settings.keep_days * 86400);
  std::int64_t total = 0;
  for (const Segment& segment : segments) total += segment.bytes;
  std::vector<std::string> deleted;
  for (const Segment& segment : segments) {
    if (total <= settings.keep_bytes && segment.stamp >= oldest_kept) break;
    std::error_code error;
    if (segment.path == current || !fs::remove(segment.path, error)) continue;
    total -= segment.bytes;
    deleted.push_back(segment.path.filename().string());
  }
  return deleted;
}

bool delete_oldest_segment(const config::SegmentSettings& settings, const std::string& name,
                           const std::string& extension, const std::string& current) {
  for (const Segment& segment : list_segments(settings, name, extension)) {
    std::error_code error;
    if (segment.path != current && fs::remove(segment.path, error)) return true;
  }
  return false;
}

}  // namespace prism::daemon
