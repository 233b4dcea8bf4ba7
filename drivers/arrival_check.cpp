// SPDX-License-Identifier: MIT
#include "drivers/arrival_check.hpp"

#include <algorithm>
#include <cmath>

namespace prism::drivers {
namespace {

// Of a session.
constexpr double kWindowS = 10;
constexpr double kToleranceS = 1;
constexpr double kRealTimeTolerance = 0.05;
constexpr double kRateTolerance = 1.2;
/// A reader's chunk spans less than this. Frames that then arrive faster than twice real time had waited.
constexpr double kChunkS = 0.1;

// Of the described rate.
constexpr double kCompareS = 100, kLeastS = 10;
constexpr double kDifferS = 1;
constexpr double kLeastTolerance = 0.01;
constexpr double kJumpS = 1;
constexpr double kEveryS = 1;
constexpr double kTaggedS = 30, kTaggedFrames = 10, kTaggedTolerance = 0.1;
/// A step longer than this many described ones, or one and a tick, contains a lost frame.
constexpr double kLoss = 1.5;

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

FrameRateCheck::FrameRateCheck(double tolerance, double rate_hz, double tick_s)
    : tolerance_(std::max(tolerance, kLeastTolerance)),
      rate_hz_(rate_hz),
      longest_step_s_(std::max(kLoss / rate_hz, 1 / rate_hz + tick_s)) {}

void FrameRateCheck::begin() {
  running_ = false;
  all_ = without_loss_ = {};
}

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
