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

}  // namespace

bool DeviceTimeCheck::leads(double x, double y) const {
  const double known_s = last_.y - anchor_.y;
  if (last_.y < kToleranceS) return false;
  const double now = known_s >= kToleranceS ? (last_.x - anchor_.x) / known_s : 0;
  const double rate = std::max({1.0, rate_, now});
  return x - anchor_.x > rate * (kRateTolerance * (y - anchor_.y) + kToleranceS);
}

bool DeviceTimeCheck::is_late(double x, double y, bool waited) {
  const bool late = std::abs(rate_ - 1) < kRealTimeTolerance && (y - anchor_.y) - (x - anchor_.x) / rate_ > kToleranceS;
  if (!late) {
    late_since_y_ = -1;
    return false;
  }
  if (!waited && y - last_.y > kWindowS) return true;
  if (late_since_y_ < 0) late_since_y_ = y;
  return y - late_since_y_ > kToleranceS;
}

void DeviceTimeCheck::keep(double x, double y) {
  last_ = {x, y};
  if (late_since_y_ >= 0 || y - next_anchor_.y < kWindowS) return;
  rate_ = (x - next_anchor_.x) / (y - next_anchor_.y);
  anchor_ = next_anchor_;
  next_anchor_ = last_;
}

bool DeviceTimeCheck::agrees(double x, double y, bool waited) {
  if (leads(x, y) || is_late(x, y, waited)) return false;
  keep(x, y);
  return true;
}

}  // namespace prism::drivers
