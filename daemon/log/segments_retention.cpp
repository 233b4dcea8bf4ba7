// SPDX-License-Identifier: MIT
// Deletion of segments: by the limits, and because the disk is full.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "base/file.hpp"
#include "base/time_scale.hpp"
#include "daemon/log/segments.hpp"

namespace prism::log {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kLookEvery_s = 60;
constexpr std::int64_t kMinGrowth_s = 10;  // shorter: the growth is not known

}  // namespace

std::optional<pipeline::RetentionStatus> Segments::retention() const {
  const std::lock_guard lock(status_mutex_);
  return status_;
}

void Segments::retain() {
  if (!policy_.deletes) return;
  const std::int64_t now_s = policy_.uptime_s();
  if (now_s < next_look_s_) return;
  next_look_s_ = now_s + scaled_s(kLookEvery_s);
  if (!begin() || !scan()) return;
  pipeline::RetentionStatus status;
  std::optional<NextDeletion> next = plan(status);
  if (next && delete_due(*next)) next = plan(status);
  status.next = std::move(next);
  const std::lock_guard lock(status_mutex_);
  status_ = std::move(status);
}

std::optional<NextDeletion> Segments::plan(pipeline::RetentionStatus& status) {
  status = {};
  status.uptime_s = policy_.uptime_s();
  status.segments = stored_.size();
  status.keep_bytes = settings_.keep_bytes;
  status.keep_s = settings_.keep_days * kDay_s;
  status.deleted_segments = (stored_.empty() ? next_ : stored_.front().number) - 1;
  status.deleted_rows = is_log() ? deleted_rows() : 0;
  for (const StoredSegment& segment : stored_) status.bytes += segment.bytes;
  if (!first_look_s_) first_look_s_ = status.uptime_s, first_bytes_ = status.bytes;
  if (stored_.empty() || stored_.front().path == current_) return std::nullopt;
  const StoredSegment& oldest = stored_.front();
  const std::int64_t since_s = status.uptime_s - *first_look_s_;
  const std::int64_t grown = status.bytes + removed_bytes_ - first_bytes_;
  const Stored stored{
      oldest.file,  rows_of(0),
      oldest.bytes, age_s(0),
      status.bytes, since_s < scaled_s(kMinGrowth_s) ? 0 : static_cast<double>(grown) / static_cast<double>(since_s)};
  return next_deletion(settings_, stored);
}

// Running time since the next segment began.
std::int64_t Segments::age_s(std::size_t i) {
  const bool is_old = stored_[i].name.number == 0;
  std::size_t next = is_old ? i : i + 1;
  while (next < stored_.size() && is_log() && first(next) == 0) ++next;
  return next < stored_.size() ? std::max<std::int64_t>(running_s() - started_s(next), 0) : 0;
}

// A deletion that is due waits for notice_s, so that it is announced. Further ones that are due then do not wait again.
// Returns true if it deleted the segment.
bool Segments::delete_due(NextDeletion& next) {
  const std::int64_t now_s = policy_.uptime_s();
  if (next.in_s > 0) {
    due_since_s_.reset();
    next_look_s_ = std::min(next_look_s_, now_s + next.in_s);
    next.in_s += policy_.notice_s;
    return false;
  }
  const std::int64_t left_s = policy_.notice_s - (now_s - *(due_since_s_ = due_since_s_.value_or(now_s)));
  next.in_s = std::max<std::int64_t>(left_s, 0);
  if (left_s <= 0 && !remove(0, next.why)) return false;
  next_look_s_ = now_s + next.in_s;
  return left_s <= 0;
}

bool Segments::remove(std::size_t i, NextDeletion::Why why) {
  const StoredSegment segment = stored_[i];
  // Another process writes it, for example a second prismd: this one locks only the newest segment. A link is only a
  // name.
  std::error_code error;
  if (!fs::is_symlink(segment.path, error) && is_locked(segment.path)) return false;
  const std::uint64_t rows = rows_of(i);
  fs::remove(segment.path, error);
  if (error) {
    if (std::exchange(kept_, segment.file) != segment.file)
      report(pipeline::Severity::kWarning, "retention",
             fmt::format("{}: {}: cannot be deleted: {}", section(), segment.path, error.message()));
    return false;
  }
  sync_directory(settings_.directory);
  removed_bytes_ += segment.bytes;
  stored_.erase(stored_.begin() + static_cast<std::ptrdiff_t>(i));
  const bool has_old =
      std::any_of(stored_.begin(), stored_.end(), [](const auto& one) { return one.name.number == 0; });
  if (segment.name.number == 0 && !has_old && !stored_.empty())
    fs::remove(index_path(), error);  // newer ones need none
  report(pipeline::Severity::kInfo, "retention",
         fmt::format("{}: deleted {}: {}", section(), segment_text(segment.file, rows, segment.bytes),
                     reason_text(settings_, why, section())));
  return true;
}

bool Segments::make_room() {
  if (!settings_.delete_when_full || !policy_.deletes || !begin()) return false;
  for (std::size_t i = 0; i < stored_.size(); ++i)
    if (stored_[i].path != current_ && remove(i, NextDeletion::Why::kDiskFull)) return true;
  return false;
}

}  // namespace prism::log
