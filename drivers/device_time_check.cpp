// SPDX-License-Identifier: MIT
#include "drivers/device_time_check.hpp"

#include <algorithm>
#include <cmath>

namespace prism::drivers {
namespace {

constexpr double kWindowS = 10;
constexpr double kToleranceS = 1;
constexpr double kRealTimeTolerance = 0.05;
constexpr double kRateTolerance = 1.2;
/// A reader's chunk spans less than this. Frames that then arrive faster than twice real time had waited.
constexpr double kChunkS = 0.1;

}  // namespace

bool DeviceTimeCheck::leads(double x, double y) const {
  const double most_s = kRateTolerance * (y - anchor_.y) + kToleranceS;
  if (last_.y < kToleranceS || x - anchor_.x <= std::max(1.0, rate_) * most_s) return false;
  const double known_s = last_.y - anchor_.y;
  const double now = known_s >= kToleranceS ? (last_.x - anchor_.x) / known_s : 0;
  const double rate = std::max({1.0, rate_, now});
  return x - anchor_.x > rate * most_s;
}

DeviceTimeCheck::Verdict DeviceTimeCheck::after_gap(double x, double y) {
  const double since_x = x - after_gap_->x, since_y = y - after_gap_->y;
  if (since_x > 2 * since_y + kChunkS) {
    after_gap_.reset();
    return Verdict::kAgrees;
  }
  return since_y > 2 * kChunkS ? Verdict::kDisagrees : Verdict::kUncertain;
}

DeviceTimeCheck::Verdict DeviceTimeCheck::lateness(double x, double y, bool waited) {
  if (std::abs(rate_ - 1) >= kRealTimeTolerance || (y - anchor_.y) - (x - anchor_.x) / rate_ <= kToleranceS) {
    late_since_y_ = -1;
    return Verdict::kAgrees;
  }
  if (late_since_y_ < 0) {
    late_since_y_ = y;
    if (!waited && y - last_.y > kWindowS) {
      after_gap_ = {x, y};
      return Verdict::kUncertain;
    }
  }
  return y - late_since_y_ > kToleranceS ? Verdict::kDisagrees : Verdict::kAgrees;
}

void DeviceTimeCheck::keep(double x, double y) {
  last_ = {x, y};
  if (late_since_y_ >= 0 || y - next_anchor_.y < kWindowS) return;
  rate_ = (x - next_anchor_.x) / (y - next_anchor_.y);
  anchor_ = next_anchor_;
  next_anchor_ = last_;
}

DeviceTimeCheck::Verdict DeviceTimeCheck::push(double x, double y, bool waited) {
  if (leads(x, y)) return Verdict::kDisagrees;
  Verdict verdict = after_gap_ ? after_gap(x, y) : Verdict::kAgrees;
  if (verdict == Verdict::kAgrees) verdict = lateness(x, y, waited);
  if (verdict == Verdict::kAgrees) keep(x, y);
  return verdict;
}

}  // namespace prism::drivers
