// SPDX-License-Identifier: MIT
#include "daemon/axis_record.hpp"

#include "daemon/arrival_clock.hpp"

namespace prism::daemon {

void AxisRecord::keep(const compensation::CompensatedWindow& row, std::int64_t session_ns, const std::string& axis,
                      int block_s) {
  if (log_) log_->append(row, session_ns);
  stability_.add(row, block_s);
  history_.add(row, axis);
  windowed_ = true;
  watch_quality(row);
  watch_plausibility(row);
}

void AxisRecord::keep(const compensation::Compensated& row) {
  last_ = row;
  sampled_ = true;
}

// A change of quality is an event; a flood of rows with the same fault is not. What is implausible has events of its
// own.
void AxisRecord::watch_quality(const compensation::CompensatedWindow& row) {
  const std::uint32_t quality = row.correction.quality & ~compensation::kImplausible;
  if (quality == last_quality_) return;
  last_quality_ = quality;
  const bool harmless =
      quality == compensation::kGood || quality == compensation::kWarming || quality == compensation::kNoModel;
  events_.add(harmless ? Severity::kInfo : Severity::kWarning, "quality",
              prefix_ + "quality is now " + compensation::quality_text(quality), host_time_ns());
}

void AxisRecord::watch_plausibility(const compensation::CompensatedWindow& row) {
  for (const PlausibilityWatch::Notice& notice : plausibility_watch_.push(row))
    events_.add(notice.entered ? Severity::kWarning : Severity::kInfo, "implausible", prefix_ + notice.text,
                host_time_ns());
}

}  // namespace prism::daemon
