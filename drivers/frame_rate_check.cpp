// SPDX-License-Identifier: MIT
#include "drivers/frame_rate_check.hpp"

#include <algorithm>
#include <cmath>

namespace prism::drivers {
namespace {

constexpr double kCompareS = 100, kLeastS = 10;
constexpr double kDifferS = 1;
constexpr double kLeastTolerance = 0.01;
constexpr double kJumpS = 1;
constexpr double kEveryS = 1;

}  // namespace

FrameRateCheck::FrameRateCheck(double tolerance) : tolerance_(std::max(tolerance, kLeastTolerance)) {}

void FrameRateCheck::push(double step, double y) {
  const double pause = y - y_;
  if (!running_ || step > pause + kJumpS || pause < -kJumpS) {
    running_ = true;
    x_ = 0;
    y_ = compared_y_ = y;
    older_ = newer_ = {0, y, 0};
    return;
  }
  x_ += step;
  y_ = y;
  older_.longest_s = std::max(older_.longest_s, pause);
  newer_.longest_s = std::max(newer_.longest_s, pause);
  if (y - compared_y_ >= kEveryS) compare();
}

void FrameRateCheck::compare() {
  compared_y_ = y_;
  const double x = x_ - older_.x, y = y_ - older_.y;
  const bool differs = std::abs(x - y) > std::max(kDifferS, tolerance_ * y) + older_.longest_s;
  if (y >= kCompareS || (differs && y >= kLeastS)) {
    differs_ = differs;
    ratio_ = x / y;
  }
  if (y_ - newer_.y < kCompareS) return;
  older_ = newer_;
  newer_ = {x_, y_, 0};
}

}  // namespace prism::drivers
