// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/resolution_finder.hpp"

#include <cmath>

#include "compensation/evaluation/statistics.hpp"

namespace prism::recordings {

void ResolutionFinder::push(double rate_deg_per_h) {
  if (length_ > 0 && rate_deg_per_h == value_) {
    ++length_;
    return;
  }
  end_run();
  value_ = rate_deg_per_h;
  length_ = std::isfinite(rate_deg_per_h) ? 1 : 0;
}

void ResolutionFinder::end_run() {
  constexpr std::size_t kRun = 3, kMost = 1000;
  values_ += length_;
  if (length_ < kRun) return;
  in_runs_ += length_;
  if (any_level_ && value_ != last_level_ && steps_.size() < kMost) steps_.push_back(std::fabs(value_ - last_level_));
  any_level_ = true;
  last_level_ = value_;
}

double ResolutionFinder::step_deg_per_h() const {
  constexpr std::size_t kEnough = 2;
  ResolutionFinder complete = *this;
  complete.end_run();
  if (complete.steps_.size() < kEnough || 2 * complete.in_runs_ < complete.values_) return 0;
  return evaluation::median_of(std::move(complete.steps_));
}

}  // namespace prism::recordings
