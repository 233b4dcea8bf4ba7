// SPDX-License-Identifier: MIT
#include "daemon/pipeline/axis_record.hpp"

#include <cmath>

namespace prism::pipeline {

void AxisRecord::keep(const compensation::CompensatedWindow& row, std::int64_t session_ns, int block_s) {
  if (log_) log_->append(row, session_ns);
  stability_.add(row, block_s);
  ++rows_.seconds;
  rows_.windows += row.window.state == compensation::WindowState::kReady;
  rows_.corrected += std::isfinite(row.corrected_deg_per_h);
  last_window_ = row;
  windowed_ = true;
}

void AxisRecord::keep(const compensation::Compensated& row) {
  last_sample_ = row;
  sampled_ = true;
}

// Only changes of quality are events. Implausible values have their own events.
void AxisRecord::watch(const compensation::CompensatedWindow& row, const Tell& tell) {
  const std::uint32_t quality = row.correction.quality & ~compensation::kImplausible;
  if (std::exchange(last_quality_, quality) != quality) {
    const bool harmless =
        quality == compensation::kGood || quality == compensation::kWarming || quality == compensation::kNoModel;
    tell(harmless ? Severity::kInfo : Severity::kWarning, "quality",
         prefix_ + "quality is now " + compensation::quality_text(quality));
  }
  for (const Notice& notice : plausibility_watch_.push(row))
    tell(notice.severity(), "implausible", prefix_ + notice.text);
  for (const Notice& notice : changes_.push(row)) tell(notice.severity(), "question", prefix_ + notice.text);
}

std::vector<std::string> AxisRecord::with_prefix(std::vector<std::string> texts) const {
  for (std::string& text : texts) text.insert(0, prefix_);
  return texts;
}

}  // namespace prism::pipeline
