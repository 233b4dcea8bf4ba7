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
constexpr double kTaggedS = 30, kTaggedFrames = 10, kTaggedTolerance = 0.1;
/// A step longer than this many described ones, or one and a tick, contains a lost frame.
constexpr double kLoss = 1.5;

}  // namespace

FrameRateCheck::FrameRateCheck(double tolerance, double rate_hz, double tick_s)
    : tolerance_(std::max(tolerance, kLeastTolerance)),
      rate_hz_(rate_hz),
      longest_step_s_(std::max(kLoss / rate_hz, 1 / rate_hz + tick_s)) {}

void FrameRateCheck::begin() {
  y_ = std::numeric_limits<double>::infinity();
  all_ = without_loss_ = {};
}

void FrameRateCheck::push(double step, double y) {
  const double pause = y - y_;
  if (step > pause + kJumpS || pause < -kJumpS) {
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

void FrameRateCheck::push_tagged(double step) {
  all_.add(step);
  if (step <= longest_step_s_) without_loss_.add(step);
  if (all_.seconds < kTaggedS || all_.count < kTaggedFrames) return;
  const Steps usual = 2 * without_loss_.count > all_.count ? without_loss_ : all_;
  const double hz = usual.count / usual.seconds;
  tagged_hz_ = std::abs(hz - rate_hz_) > std::max(kTaggedTolerance, tolerance_) * rate_hz_ ? hz : 0;
  all_ = without_loss_ = {};
}

}  // namespace prism::drivers
