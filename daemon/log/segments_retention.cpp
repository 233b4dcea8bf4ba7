// SPDX-License-Identifier: MIT
// Deletion of segments: by the limits, and because the disk is full.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "base/file.hpp"
#include "base/text_number.hpp"
#include "base/time_scale.hpp"
#include "daemon/log/segments.hpp"

namespace prism::log {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kLookEvery_s = 60;
constexpr std::int64_t kMinGrowth_s = 10;  // shorter: the growth is not known

// For a log without an end line: rows begin with a digit.
std::uint64_t count_rows(const std::string& path) {
  auto in = FileReader::open(path);
  std::uint64_t rows = 0;
  for (std::string line; in && in->read_line(line);) rows += !line.empty() && line[0] >= '0' && line[0] <= '9';
  return rows;
}

}  // namespace

std::uint64_t Segments::rows_in(const Segment& segment) {
  const std::uint64_t rows = index_.rows(segment.file);
  if (rows > 0 || extension_ != ".csv") return rows;
  const auto [counted, is_new] = counted_.try_emplace(segment.file, 0);
  if (is_new) counted->second = count_rows(segment.path);
  return counted->second;
}

std::optional<pipeline::RetentionStatus> Segments::retention() const {
  const std::lock_guard lock(status_mutex_);
  return status_;
}

void Segments::retain() {
  if (!policy_.deletes) return;
  measure();
  const std::int64_t now_s = policy_.uptime_s();
  if (now_s < next_look_s_) return;
  next_look_s_ = now_s + scaled_s(kLookEvery_s);
  std::error_code error;
  if (fs::is_directory(settings_.directory, error)) number_all();
  const std::vector<Segment> segments = list();
  pipeline::RetentionStatus status;
  status.uptime_s = now_s;
  std::optional<NextDeletion> next = plan(segments, status);
  if (next && delete_due(segments, *next)) {
    status = pipeline::RetentionStatus();
    status.uptime_s = now_s;
    next = plan(list(), status);
  }
  status.next = std::move(next);
  status.deleted_segments = index_.deleted_segments();
  status.deleted_rows = index_.deleted_rows();
  const std::lock_guard lock(status_mutex_);
  status_ = std::move(status);
}

std::optional<NextDeletion> Segments::plan(const std::vector<Segment>& segments, pipeline::RetentionStatus& status) {
  status.segments = segments.size();
  status.keep_bytes = settings_.keep_bytes;
  status.keep_s = settings_.keep_days * kDay_s;
  for (const Segment& segment : segments) status.bytes += segment.bytes;
  if (!first_look_s_) first_look_s_ = status.uptime_s, first_bytes_ = status.bytes;
  if (segments.empty() || segments.front().path == current_) return std::nullopt;
  const Segment& oldest = segments.front();
  const std::int64_t since_s = status.uptime_s - *first_look_s_;
  const std::int64_t grown = status.bytes + removed_bytes_ - first_bytes_;
  const Stored stored{
      oldest.file,  rows_in(oldest),
      oldest.bytes, index_.age_s(oldest.file),
      status.bytes, since_s < scaled_s(kMinGrowth_s) ? 0 : static_cast<double>(grown) / static_cast<double>(since_s)};
  return next_deletion(settings_, stored);
}

// A deletion that is due waits for notice_s, so that it is announced. Further ones that are due then do not wait again.
// Returns true if it deleted the segment.
bool Segments::delete_due(const std::vector<Segment>& segments, NextDeletion& next) {
  const std::int64_t now_s = policy_.uptime_s();
  if (next.in_s > 0) {
    due_since_s_.reset();
    next_look_s_ = std::min(next_look_s_, now_s + next.in_s);
    next.in_s += policy_.notice_s;
    return false;
  }
  const std::int64_t left_s = policy_.notice_s - (now_s - *(due_since_s_ = due_since_s_.value_or(now_s)));
  next.in_s = std::max<std::int64_t>(left_s, 0);
  if (left_s <= 0 && !remove(segments.front(), next.why)) return false;
  next_look_s_ = now_s + next.in_s;
  return left_s <= 0;
}

bool Segments::remove(const Segment& segment, NextDeletion::Why why) {
  // Another process writes it, for example a second prismd: this one locks only the newest segment. A link is only a
  // name.
  std::error_code error;
  if (!fs::is_symlink(segment.path, error) && is_locked(segment.path)) return false;
  const auto is_next = [&](const Segment& other) { return index_.number(other.file) > index_.number(segment.file); };
  const std::vector<Segment> all = list();
  const auto next = std::find_if(all.begin(), all.end(), is_next);
  const pipeline::SegmentDeletion deletion{segment.file, rows_in(segment),
                                           next == all.end() ? 0 : parse_utc_file_text(next->stamp).value_or(0)};
  index_.deleting(deletion);
  fs::remove(segment.path, error);
  if (error) {
    if (std::exchange(kept_, segment.file) != segment.file)
      report(pipeline::Severity::kWarning, "retention",
             fmt::format("{}: {}: cannot be deleted: {}", section(), segment.path, error.message()));
    return false;
  }
  sync_directory(settings_.directory);
  removed_bytes_ += segment.bytes;
  record_deletion(deletion, fmt::format("{}: {}", segment_text(segment.file, deletion.rows, segment.bytes),
                                        reason_text(settings_, why, section())));
  return true;
}

void Segments::record_deletion(const pipeline::SegmentDeletion& deletion, const std::string& text) {
  counted_.erase(deletion.file);
  index_.deleted(deletion);
  report(pipeline::Severity::kInfo, "retention", fmt::format("{}: deleted {}", section(), text));
}

bool Segments::make_room() {
  if (!settings_.delete_when_full || !policy_.deletes) return false;
  const std::vector<Segment> segments = list();
  return std::any_of(segments.begin(), segments.end(), [this](const Segment& segment) {
    return segment.path != current_ && remove(segment, NextDeletion::Why::kDiskFull);
  });
}

}  // namespace prism::log
