// SPDX-License-Identifier: MIT
// Computes the times of readings, and rates from angles.
#include "drivers/clock.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace prism::drivers {

// Andrew's monotone chain, the lower half, one point at a time.

namespace {

/// If the clock drift only increases, every point is on the hull; half of them are sufficient.
constexpr std::size_t kMaxPoints = 4096;

}  // namespace

void LowerHull::clear() { hull_.clear(); }

void LowerHull::push(double x, double y) {
  least_ = hull_.empty() ? y - x : std::min(least_, y - x);
  while (hull_.size() >= 2) {
    const Point& a = hull_[hull_.size() - 2];
    const Point& b = hull_.back();
    if ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x) > 0) break;  // a, b, new turn left: b stays
    hull_.pop_back();
  }
  hull_.push_back({x, y});
  if (hull_.size() > kMaxPoints) thin();
}

void LowerHull::thin() {
  std::size_t kept = 1;
  for (std::size_t i = 2; i + 1 < hull_.size(); i += 2) hull_[kept++] = hull_[i];
  hull_[kept++] = hull_.back();
  hull_.resize(kept);
}

LowerHull::StraightLine LowerHull::edge() const {
  if (hull_.size() < 2) return nominal();
  const double middle = 0.5 * (hull_.front().x + hull_.back().x);
  const auto right =
      std::lower_bound(hull_.begin() + 1, hull_.end() - 1, middle, [](const Point& p, double m) { return p.x < m; });
  const Point& b = *right;
  const Point& a = *(right - 1);
  return {a.x, a.y, (b.y - a.y) / (b.x - a.x)};
}

namespace {

/// If all arrivals are late for this long, it is a shift and not a stall.
constexpr double kShiftS = 1;
/// Assumed minimum jitter of arrival times, s.
constexpr double kLeastJitterS = 1e-3;
constexpr std::uint64_t kLeastPoints = 20;
/// Buffers between gyro and reader contain more than this: a reader that is late by less has lost nothing.
constexpr double kOverflowS = 0.1;
/// A larger step back of a stamp means that a clock was set.
constexpr std::int64_t kClockSetNs = 1'000'000'000;
/// An interval is longer than usual above this ratio.
constexpr double kLonger = 1.5;

}  // namespace

Clock::Clock(wire::FrameDescriptionPtr description, ClockSettings settings)
    : description_(std::move(description)),
      settings_(settings),
      steps_(description_, settings.source == ClockSource::kHost),
      tick_s_(description_->counter ? 1 / description_->counter->ticks_per_s : description_->period_s()),
      axes_(description_->axes.size()),
      rate_check_(description_->rate_tolerance, description_->rate_hz, tick_s_) {
  const double milliticks = 1000 * (description_->counter ? description_->counter->ticks_per_s : description_->rate_hz);
  if (std::round(milliticks) == milliticks) milliticks_per_s_ = std::llround(milliticks);
  byte_time_ns_ = description_->wire.byte_time_ns();
  status_.period_s = description_->period_s();
  const double gyro_types =
      static_cast<double>(std::count_if(description_->kinds.begin(), description_->kinds.end(),
                                        [](const auto& kind) { return kind.roles.carries_gyro(); }));
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const wire::AxisRule& rule = description_->axes[i];
    const double half_wrap_s = 0.5 * rule.wrap * std::abs(rule.scale) / settings_.max_rate_deg_per_h;
    axes_[i].longest_s = rule.wrap > 0 ? std::min(settings_.max_difference_s, half_wrap_s) : settings_.max_difference_s;
    axes_[i].usual_s = description_->period_s() * std::max(gyro_types, 1.0);
  }
}

void Clock::reset() {
  running_ = false;
  rate_check_.begin();
  steps_.reset();
  for (AxisState& axis : axes_) axis.missing = 0;
  last_time_ns_ = 0;
  status_.residual_s = 0;
}

/// When the device measured the reading: arrival minus latency and wire time.
std::int64_t Clock::measured_ns(const wire::DecodedMessage& reading) const {
  return reading.arrival_ns - std::llround(byte_time_ns_ * reading.length + 1e9 * reading.latency_s);
}

void Clock::start(const wire::DecodedMessage& reading) {
  running_ = true;
  forget_angles();
  origin_ns_ = measured_ns(reading);
  ticks_ = x_ = gyro_x_ = 0;
  for (AxisState& axis : axes_) axis.x = 0;
  active_.clear();
  next_.clear();
  active_.push(0, 0);
  next_since_x_ = 0;
  jitter_s_ = kLeastJitterS;
  points_ = 1;
  late_since_y_ = -1;
  slope_ = 1;
  device_check_.begin();
  last_y_ = 0;
  status_.period_s = description_->period_s();
  status_.period_is_estimated = false;
  status_.residual_s = 0;
}

// Integer ticks over integer milliticks per second: exact, so that one day of fast replay ends on the nanosecond.
std::optional<std::int64_t> Clock::stamp_device(const wire::DecodedMessage& reading, const CounterStep& step) {
  using Verdict = DeviceTimeCheck::Verdict;
  const double x = (ticks_ + step.ticks) * tick_s_;
  const double y = 1e-9 * static_cast<double>(measured_ns(reading) - origin_ns_);
  const bool waited = waited_to_be_read(reading, description_->period_s(), y - last_y_);
  last_y_ = y;
  const Verdict verdict = step.restarted                    ? Verdict::kDisagrees
                          : settings_.arrivals_are_measured ? device_check_.push(x, y, waited)
                                                            : Verdict::kAgrees;
  if (verdict == Verdict::kDisagrees) {
    ++status_.resets;
    began_session_ = true;
    last_time_ns_ = 0;
    start(reading);
    return origin_ns_;
  }
  ticks_ += step.ticks;
  x_ = x;
  if (verdict == Verdict::kUncertain) return std::nullopt;
  if (milliticks_per_s_ == 0) return origin_ns_ + std::llround(1e9 * x_);
  constexpr std::int64_t kUnit = 1'000'000'000'000;
  const auto ticks = static_cast<std::int64_t>(ticks_);
  const std::int64_t milli = milliticks_per_s_, whole = ticks / milli, rest = ticks % milli;
  return origin_ns_ + whole * kUnit +
         static_cast<std::int64_t>((static_cast<__int128>(rest) * kUnit + milli / 2) / milli);
}

/// True if the line no longer explains the arrivals; see the class.
bool Clock::out_of_step(double residual_s, double y, std::uint32_t behind) {
  if (residual_s < -settings_.residual_limit_s) return true;
  if (residual_s <= settings_.residual_limit_s) {
    late_since_y_ = -1;
    return false;
  }
  if (behind >= description_->max_frame_bytes)
    return false;  // only the last frame of a chunk shows how late the reader is
  if (late_since_y_ < 0) {
    late_since_y_ = std::max(y, 0.0);
    least_late_s_ = residual_s;
  }
  least_late_s_ = std::min(least_late_s_, residual_s);
  return y - late_since_y_ > kShiftS;
}

/// True if frames lost unseen explain why all arrivals are late: counts them, and corrects x.
bool Clock::recount(double& residual_s) {
  const double turn = steps_.unseen_ticks(), turn_s = turn * tick_s_ * slope_;
  if (residual_s < 0 || turn == 0 || points_ < kLeastPoints || least_late_s_ < kOverflowS) return false;
  const double turns = std::round(least_late_s_ / turn_s);
  if (turns < 1 || std::abs(least_late_s_ - turns * turn_s) > settings_.residual_limit_s) return false;
  const std::uint32_t frames = steps_.frames_of(turns * turn);
  miss({.missing = frames, .by_arrival = frames});
  ticks_ += turns * turn;
  x_ = ticks_ * tick_s_;
  residual_s -= turns * turn_s;
  late_since_y_ = -1;
  return true;
}

void Clock::fit(double y, double residual_s) {
  active_.push(x_, y);
  if (x_ - next_since_x_ >= settings_.switch_s) {
    if (!next_.empty()) {
      std::swap(active_, next_);
      next_.clear();
    }
    next_since_x_ = x_;
  }
  if (next_since_x_ > 0) next_.push(x_, y);
  ++points_;
  jitter_s_ = std::max(jitter_s_, residual_s);
  const double span = active_.span();
  const double unsure = span > 0 ? jitter_s_ / span : 1;
  const double slope = active_.edge().slope;
  const bool telling = unsure < description_->rate_tolerance || std::abs(slope - 1) > 3 * unsure;
  const bool estimated = points_ >= kLeastPoints && telling && std::abs(slope - 1) < 0.5;
  slope_ = estimated ? slope : 1;
  status_.period_is_estimated = estimated;
  status_.period_s = description_->period_s() * slope_;
}

std::int64_t Clock::stamp_host(const wire::DecodedMessage& reading, const CounterStep& step) {
  const double y = 1e-9 * static_cast<double>(measured_ns(reading) - origin_ns_);
  ticks_ += step.ticks;
  x_ = ticks_ * tick_s_;
  const LowerHull::StraightLine before = status_.period_is_estimated ? active_.edge() : active_.nominal();
  double residual = y - before.at(x_);
  if (out_of_step(residual, y, reading.behind) && !recount(residual)) {
    // The line begins with what waited to be read: until then every arrival is late.
    const bool is_late_begin =
        residual < 0 && residual > -kShiftS && measured_ns(reading) - begin_ns_ < std::llround(1e9 * kShiftS);
    if (!is_late_begin) ++status_.resets;
    start(reading);
    return origin_ns_;
  }
  if (step.ticks > 0 && residual <= settings_.residual_limit_s) fit(y, residual);
  const LowerHull::StraightLine line = status_.period_is_estimated ? active_.edge() : active_.nominal();
  status_.residual_s = y - line.at(x_);
  return origin_ns_ + std::llround(1e9 * line.at(x_));
}

void Clock::forget_angles() {
  for (AxisState& axis : axes_) axis.has_angle = false;
}

void Clock::miss(const CounterStep& step) {
  for (AxisState& axis : axes_) axis.missing += step.missing;
  status_.missing_frames += step.missing;
  status_.missing_by_arrival += step.by_arrival;
}

bool Clock::push(const wire::DecodedMessage& reading) {
  std::optional<std::int64_t> time;
  began_session_ = false;
  const CounterStep step = steps_.push(reading, slope_);
  if (!running_) {
    begin_ns_ = measured_ns(reading);
    start(reading);
    time = origin_ns_;
  } else {
    if (step.duplicate) {
      ++status_.duplicates;
      return false;
    }
    const std::uint64_t resets = status_.resets;
    time = settings_.source == ClockSource::kDevice ? stamp_device(reading, step) : stamp_host(reading, step);
    if (status_.resets == resets) {
      miss(time ? step : CounterStep{.missing = step.missing + 1});
    } else if (settings_.source == ClockSource::kHost && last_time_ns_ - *time > kClockSetNs) {
      last_time_ns_ = *time;
    }
  }
  if (time) last_time_ns_ = last_time_ns_ != 0 ? std::max(*time, last_time_ns_) : *time;
  if (settings_.check_frame_rate && settings_.arrivals_are_measured)
    rate_check_.push(step.ticks * tick_s_, 1e-9 * static_cast<double>(reading.arrival_ns));
  if (reading.has_gyro && !description_->counts_frames()) {
    if (const double since_s = x_ - std::exchange(gyro_x_, x_); since_s > 0) rate_check_.push_tagged(since_s);
  }
  counted_ = false;
  return time && reading.has_gyro;
}

/// Difference of the accumulated angle to the one before, in the reading's unit, and the interval between them.
std::optional<double> Clock::angle_difference(const wire::AxisReading& reading, std::size_t axis, double& nominal_s) {
  AxisState& state = axes_[axis];
  if (!reading.valid) return state.has_angle ? std::optional(kUnknown) : std::nullopt;
  const double before = std::exchange(state.angle, reading.value);
  nominal_s = x_ - std::exchange(state.angle_x, x_);
  if (!std::exchange(state.has_angle, true)) return std::nullopt;
  if (nominal_s > std::max(state.longest_s, kLonger * state.usual_s)) return std::nullopt;
  if (nominal_s > 0) state.usual_s = std::min(state.usual_s, nominal_s);
  double difference = reading.value - before;
  const double wrap = description_->axes[axis].wrap;
  if (wrap > 0) difference -= wrap * std::round(difference / wrap);
  return difference;
}

/// The angle in the reading's unit (or the rate); sets the nominal seconds of its interval.
std::optional<double> Clock::difference(const wire::AxisReading& reading, std::size_t axis, double& nominal_s) {
  const wire::GyroRule& gyro = description_->gyro;
  AxisState& state = axes_[axis];
  const double since_last_s = x_ - std::exchange(state.x, x_);
  const bool varies =
      description_->counter && description_->counter->step_varies && gyro.meaning == wire::RateEncoding::kIncrement;
  nominal_s = gyro.interval_s > 0 ? gyro.interval_s : varies ? since_last_s : description_->period_s();
  if (gyro.meaning == wire::RateEncoding::kAccumulated) return angle_difference(reading, axis, nominal_s);
  // a lost frame took its increment with it, so that the interval of this one is unknown
  if (varies && gyro.interval_s <= 0 && since_last_s > settings_.max_difference_s) return std::nullopt;
  return reading.valid ? reading.value : kUnknown;
}

std::optional<Sample> Clock::sample(const wire::DecodedMessage& reading, std::size_t axis) {
  const wire::AxisReading& gyro = reading.gyro[axis];
  if (!gyro.carried) return std::nullopt;
  double nominal_s = 0;
  const std::optional<double> number = difference(gyro, axis, nominal_s);
  if (!number || !(nominal_s > 0)) return std::nullopt;
  Sample sample;
  sample.time_ns = last_time_ns_;
  sample.interval_s = nominal_s * slope_;
  const double scaled = *number * description_->axes[axis].scale;
  sample.rate_deg_per_h = description_->gyro.meaning == wire::RateEncoding::kRate ? scaled : scaled / sample.interval_s;
  const int own = description_->axes[axis].thermometer;
  sample.temperature_degc = own < 0 ? reading.temperature_degc : reading.sensors[static_cast<std::size_t>(own)];
  sample.uhfo_v = reading.uhfo_v;
  sample.missing_frames = std::exchange(axes_[axis].missing, 0);
  sample.status = reading.status;
  sample.out_of_bounds = reading.out_of_bounds;
  sample.out_of_bounds.rate = gyro.out_of_bounds;
  sample.clocks_differ = rate_check_.differs() && !status_.period_is_estimated;  // estimated: the times are right
  if (own >= 0) sample.out_of_bounds.temperature = false;
  if (!std::exchange(counted_, true)) ++status_.samples;
  return sample;
}

}  // namespace prism::drivers
