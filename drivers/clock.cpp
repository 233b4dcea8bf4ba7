// SPDX-License-Identifier: MIT
// Computes the times of readings, and rates from angles.
#include "drivers/clock.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace prism::drivers {
namespace {

// Counter.
constexpr double kNearFrames = 4;
/// After a longer time without data the counter may have wrapped unseen; shorter gaps may be a stalled machine.
constexpr double kWrapUnseenS = 1;
/// This many bytes at once were waiting to be read.
constexpr std::uint32_t kBacklogBytes = 1024;
/// A restart can be distinguished from lost frames only if the counter covers this many frames.
constexpr double kTellingFrames = 64;

/// If all arrivals are late for this long, it is a shift and not a stall.
constexpr double kShiftS = 1;

// Host.
constexpr double kResidualLimitS = 0.020;
constexpr std::uint64_t kLeastPoints = 20;
/// Buffers between gyro and reader contain more than this: a reader that is late by less has lost nothing.
constexpr double kOverflowS = 0.1;
/// A larger step back of a stamp means that a clock was set.
constexpr std::int64_t kClockSetNs = 1'000'000'000;

// Device.
constexpr double kWindowS = 10;
constexpr double kToleranceS = 1;
constexpr double kRealTimeTolerance = 0.05;
constexpr double kRateTolerance = 1.2;
/// A reader's chunk spans less than this. Frames that then arrive faster than twice real time had waited.
constexpr double kChunkS = 0.1;

/// An interval between two angles is longer than usual above this ratio.
constexpr double kLonger = 1.5;

double ticks_per_s(const wire::FrameDescription& frames) {
  return frames.counter ? frames.counter->ticks_per_s : frames.rate_hz;
}

std::uint32_t whole(double frames) { return static_cast<std::uint32_t>(std::llround(std::clamp(frames, 0.0, 4e9))); }

}  // namespace

// Andrew's monotone chain, the lower half, one point at a time.
void LowerHull::push(TimePoint point) {
  const auto [x, y] = point;
  least_ = hull_.empty() ? y - x : std::min(least_, y - x);
  while (hull_.size() >= 2) {
    const TimePoint& a = hull_[hull_.size() - 2];
    const TimePoint& b = hull_.back();
    if ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x) > 0) break;  // a, b, new turn left: b stays
    hull_.pop_back();
  }
  hull_.push_back(point);
}

LowerHull::StraightLine LowerHull::edge() const {
  if (hull_.size() < 2) return nominal();
  const double middle = 0.5 * (hull_.front().x + hull_.back().x);
  const auto right = std::lower_bound(hull_.begin() + 1, hull_.end() - 1, middle,
                                      [](const TimePoint& p, double m) { return p.x < m; });
  const TimePoint& b = *right;
  const TimePoint& a = *(right - 1);
  return {a.x, a.y, (b.y - a.y) / (b.x - a.x)};
}

Clock::Clock(wire::FrameDescriptionPtr description, ClockSettings settings)
    : description_(std::move(description)),
      settings_(settings),
      tick_s_(1 / ticks_per_s(*description_)),
      axes_(description_->axes.size()),
      rate_check_(description_->rate_tolerance, description_->rate_hz, tick_s_) {
  const double milliticks = 1000 * ticks_per_s(*description_);
  if (std::round(milliticks) == milliticks) milliticks_per_s_ = std::llround(milliticks);
  if (const auto& rule = description_->counter) {
    const double frame_ticks = rule->step_varies ? rule->ticks_per_s * description_->period_s() : rule->ticks_per_frame;
    near_ticks_ = kNearFrames * frame_ticks;
  }
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
  last_counter_.reset();
  held_.reset();
  for (AxisState& axis : axes_) axis.missing = 0;
  last_time_ns_ = 0;
  status_.residual_s = 0;
}

// Counter: ticks and lost frames from the reading before.

/// Of one frame.
double Clock::frame_ticks() const {
  if (!description_->counter) return 1;
  const wire::CounterRule& rule = *description_->counter;
  return last_counter_ ? rule.ticks_per_frame : rule.ticks_per_s * description_->period_s();
}

/// True if the reading waited to be read since the one before, which arrived elapsed_s earlier: its chunk contains
/// more than the line delivers at once.
bool Clock::waited(const wire::DecodedMessage& reading, double elapsed_s) const {
  const double waited_s = static_cast<double>(reading.behind) / reading.length * description_->period_s();
  return reading.behind >= kBacklogBytes || waited_s > elapsed_s / 2;
}

Clock::Step Clock::step_to(const wire::DecodedMessage& reading) const {
  Step step;
  if (!reading.has_counter || !last_counter_) {
    if (!reading.has_gyro || last_counter_) return step;
    step.ticks = (1.0 + reading.damaged) * frame_ticks();
    step.missing = reading.damaged;
    return step;
  }
  const bool is_host = settings_.source == ClockSource::kHost;
  const wire::CounterRule& rule = *description_->counter;
  const double modulus = rule.modulus == 0 ? 0x1p64 : static_cast<double>(rule.modulus);
  step.ticks = ticks_to(reading);
  double unseen = 0;  // full periods of the counter
  const double elapsed_s = 1e-9 * static_cast<double>(reading.arrival_ns - last_arrival_ns_);
  if (is_host && rule.modulus != 0 && elapsed_s > kWrapUnseenS && !waited(reading, elapsed_s))
    unseen = modulus * std::max(0.0, std::round((elapsed_s * rule.ticks_per_s / slope_ - step.ticks) / modulus));
  step.ticks += unseen;
  step.duplicate = step.ticks == 0;
  if (!is_host && modulus / rule.ticks_per_frame >= kTellingFrames && step.ticks > modulus / 2) {
    step.restarted = true;
    step.ticks = rule.ticks_per_frame;
  }
  if (rule.step_varies) return step;
  step.missing = whole(step.ticks / rule.ticks_per_frame - 1);
  step.by_arrival = std::min(step.missing, whole(unseen / rule.ticks_per_frame));
  return step;
}

void Clock::miss(std::uint32_t frames, std::uint32_t by_arrival) {
  for (AxisState& axis : axes_) axis.missing += frames;
  status_.missing_frames += frames;
  status_.missing_by_arrival += by_arrival;
}

// Stamps.

/// When the device measured the reading: arrival minus latency and wire time.
std::int64_t Clock::measured_ns(const wire::DecodedMessage& reading) const {
  return reading.arrival_ns - std::llround(byte_time_ns_ * reading.length + 1e9 * reading.latency_s);
}

/// The reading's time is the new origin.
std::int64_t Clock::start(const wire::DecodedMessage& reading) {
  origin_ns_ = measured_ns(reading);
  ticks_ = x_ = gyro_x_ = 0;
  for (AxisState& axis : axes_) {
    axis.x = 0;
    axis.angle.reset();
  }
  late_since_y_ = -1;
  slope_ = 1;
  fit_ = {};
  fit_.active.push({0, 0});
  pace_ = {};
  status_.period_s = description_->period_s();
  status_.period_is_estimated = false;
  status_.residual_s = 0;
  return origin_ns_;
}

/// True if every arrival has been later than the limit for more than kShiftS.
bool Clock::stays_late(double y, double late_s, double limit_s) {
  if (late_s <= limit_s) {
    late_since_y_ = -1;
    return false;
  }
  if (late_since_y_ < 0) {
    late_since_y_ = std::max(y, 0.0);
    least_late_s_ = late_s;
  }
  least_late_s_ = std::min(least_late_s_, late_s);
  return y - late_since_y_ > kShiftS;
}

/// True if device time would be before arrival.
bool Clock::leads(double y) const {
  if (pace_.last.y < kToleranceS) return false;
  const double known_s = pace_.last.y - pace_.anchor.y;
  const double now = known_s >= kToleranceS ? (pace_.last.x - pace_.anchor.x) / known_s : 0;
  const double most_s = kRateTolerance * (y - pace_.anchor.y) + kToleranceS;
  return x_ - pace_.anchor.x > std::max({1.0, pace_.rate, now}) * most_s;
}

/// Device time and arrival of the reading, see the class. After kDisagrees, start() must follow.
Clock::Verdict Clock::compare(const wire::DecodedMessage& reading, double y) {
  if (leads(y)) return Verdict::kDisagrees;
  if (pace_.after_gap) {
    const double since_x = x_ - pace_.after_gap->x, since_y = y - pace_.after_gap->y;
    if (since_x <= 2 * since_y + kChunkS) return since_y > 2 * kChunkS ? Verdict::kDisagrees : Verdict::kUncertain;
    pace_.after_gap.reset();
  }
  const bool is_real_time = std::abs(pace_.rate - 1) < kRealTimeTolerance;
  const double late_s = is_real_time ? (y - pace_.anchor.y) - (x_ - pace_.anchor.x) / pace_.rate : 0;
  const bool was_late = late_since_y_ >= 0;
  if (stays_late(y, late_s, kToleranceS)) return Verdict::kDisagrees;
  const double pause_s = y - pace_.last.y;
  if (late_since_y_ >= 0 && !was_late && pause_s > kWindowS && !waited(reading, pause_s)) {
    pace_.after_gap = {x_, y};
    return Verdict::kUncertain;
  }
  pace_.last = {x_, y};
  if (late_since_y_ >= 0 || y - pace_.next_anchor.y < kWindowS) return Verdict::kAgrees;
  pace_.rate = (x_ - pace_.next_anchor.x) / (y - pace_.next_anchor.y);
  pace_.anchor = std::exchange(pace_.next_anchor, pace_.last);
  return Verdict::kAgrees;
}

// Integer ticks over integer milliticks per second: exact, so that one day of fast replay ends on the nanosecond.
std::optional<std::int64_t> Clock::stamp_device(const wire::DecodedMessage& reading, const Step& step, double y) {
  const Verdict verdict = step.restarted                    ? Verdict::kDisagrees
                          : settings_.arrivals_are_measured ? compare(reading, y)
                                                            : Verdict::kAgrees;
  if (verdict == Verdict::kDisagrees) {
    ++status_.resets;
    began_session_ = true;
    last_time_ns_ = 0;
    return start(reading);
  }
  miss(step.missing + (verdict == Verdict::kUncertain), step.by_arrival);
  if (verdict == Verdict::kUncertain) return std::nullopt;
  if (milliticks_per_s_ == 0) return origin_ns_ + std::llround(1e9 * x_);
  const __int128 picoticks = static_cast<__int128>(ticks_) * 1'000'000'000'000;
  return origin_ns_ + static_cast<std::int64_t>((picoticks + milliticks_per_s_ / 2) / milliticks_per_s_);
}

LowerHull::StraightLine Clock::line() const {
  return status_.period_is_estimated ? fit_.active.edge() : fit_.active.nominal();
}

/// True if the line no longer explains the arrivals; see the class.
bool Clock::out_of_step(double residual_s, double y, std::uint32_t behind) {
  if (residual_s < -kResidualLimitS) return true;
  if (residual_s > kResidualLimitS && behind >= description_->max_frame_bytes)
    return false;  // only the last frame of a chunk shows how late the reader is
  return stays_late(y, residual_s, kResidualLimitS);
}

/// True if frames lost unseen explain why all arrivals are late: counts them, and corrects x.
bool Clock::recount(double& residual_s) {
  // The least that can be lost unseen: a counter period, or a frame without a counter; 0: none.
  const double turn = !last_counter_                       ? frame_ticks()
                      : description_->counter->step_varies ? 0
                                                           : static_cast<double>(description_->counter->modulus);
  const double turn_s = turn * tick_s_ * slope_;
  if (residual_s < 0 || turn == 0 || fit_.points < kLeastPoints || least_late_s_ < kOverflowS) return false;
  const double turns = std::round(least_late_s_ / turn_s);
  if (turns < 1 || std::abs(least_late_s_ - turns * turn_s) > kResidualLimitS) return false;
  const std::uint32_t frames = whole(turns * turn / frame_ticks());
  miss(frames, frames);
  ticks_ += turns * turn;
  x_ = ticks_ * tick_s_;
  residual_s -= turns * turn_s;
  late_since_y_ = -1;
  return true;
}

void Clock::fit(double y, double residual_s) {
  fit_.active.push({x_, y});
  if (x_ - fit_.next_since_x >= settings_.switch_s) {
    if (!fit_.next.empty()) fit_.active = std::exchange(fit_.next, {});
    fit_.next_since_x = x_;
  }
  if (fit_.next_since_x > 0) fit_.next.push({x_, y});
  ++fit_.points;
  fit_.jitter_s = std::max(fit_.jitter_s, residual_s);
  const double span = fit_.active.span();
  const double unsure = span > 0 ? fit_.jitter_s / span : 1;
  const double slope = fit_.active.edge().slope;
  const bool telling = unsure < description_->rate_tolerance || std::abs(slope - 1) > 3 * unsure;
  const bool estimated = fit_.points >= kLeastPoints && telling && std::abs(slope - 1) < 0.5;
  slope_ = estimated ? slope : 1;
  status_.period_is_estimated = estimated;
  status_.period_s = description_->period_s() * slope_;
}

std::int64_t Clock::stamp_host(const wire::DecodedMessage& reading, const Step& step, double y) {
  double residual = y - line().at(x_);
  if (out_of_step(residual, y, reading.behind) && !recount(residual)) {
    // The line begins with what waited to be read: until then every arrival is late.
    const bool is_late_begin =
        residual < 0 && residual > -kShiftS && measured_ns(reading) - begin_ns_ < std::llround(1e9 * kShiftS);
    start(reading);
    if (is_late_begin) {
      miss(step.missing, step.by_arrival);
    } else {
      ++status_.resets;
      if (last_time_ns_ - origin_ns_ > kClockSetNs) last_time_ns_ = origin_ns_;
    }
    return origin_ns_;
  }
  miss(step.missing, step.by_arrival);
  if (step.ticks > 0 && residual <= kResidualLimitS) fit(y, residual);
  const double fitted_y = line().at(x_);
  status_.residual_s = y - fitted_y;
  return origin_ns_ + std::llround(1e9 * fitted_y);
}

bool Clock::push(const wire::DecodedMessage& reading) {
  began_session_ = counted_ = false;
  const Step step = running_ ? step_to(reading) : Step{};
  last_arrival_ns_ = reading.arrival_ns;
  if (reading.has_counter) last_counter_ = reading.counter;
  if (step.duplicate) {
    ++status_.duplicates;
    return false;
  }
  std::optional<std::int64_t> time;
  if (std::exchange(running_, true)) {
    ticks_ += step.ticks;
    x_ = ticks_ * tick_s_;
    const double y = 1e-9 * static_cast<double>(measured_ns(reading) - origin_ns_);
    time = settings_.source == ClockSource::kDevice ? stamp_device(reading, step, y) : stamp_host(reading, step, y);
  } else {
    begin_ns_ = measured_ns(reading);
    time = start(reading);
  }
  if (time) last_time_ns_ = last_time_ns_ != 0 ? std::max(*time, last_time_ns_) : *time;
  if (settings_.check_frame_rate && settings_.arrivals_are_measured)
    rate_check_.push(step.ticks * tick_s_, 1e-9 * static_cast<double>(reading.arrival_ns));
  if (reading.has_gyro && !description_->counts_frames()) {
    if (const double since_s = x_ - std::exchange(gyro_x_, x_); since_s > 0) rate_check_.push_tagged(since_s);
  }
  return time && reading.has_gyro;
}

// Rates.

/// The rate or angle in the reading's unit; sets the nominal seconds of its interval.
std::optional<double> Clock::measured(const wire::AxisReading& reading, std::size_t axis, double& nominal_s) {
  const wire::GyroRule& gyro = description_->gyro;
  AxisState& state = axes_[axis];
  nominal_s = gyro.interval_s > 0 ? gyro.interval_s : description_->period_s();
  const double number = reading.valid ? reading.value : kUnknown;
  if (gyro.meaning != wire::RateEncoding::kAccumulated) {
    const bool is_increment = gyro.meaning == wire::RateEncoding::kIncrement && gyro.interval_s <= 0;
    if (!is_increment || !description_->counter || !description_->counter->step_varies) return number;
    nominal_s = x_ - std::exchange(state.x, x_);
    // a lost frame took its increment with it, so that the interval of this one is unknown
    return nominal_s > settings_.max_difference_s ? std::nullopt : std::optional(number);
  }
  if (!reading.valid) return state.angle ? std::optional(kUnknown) : std::nullopt;
  const std::optional<double> before = std::exchange(state.angle, number);
  nominal_s = x_ - std::exchange(state.x, x_);
  if (!before || nominal_s > std::max(state.longest_s, kLonger * state.usual_s)) return std::nullopt;
  if (nominal_s > 0) state.usual_s = std::min(state.usual_s, nominal_s);
  const double difference = number - *before, wrap = description_->axes[axis].wrap;
  return wrap > 0 ? difference - wrap * std::round(difference / wrap) : difference;
}

std::optional<Sample> Clock::sample(const wire::DecodedMessage& reading, std::size_t axis) {
  const wire::AxisReading& gyro = reading.gyro[axis];
  if (!gyro.carried) return std::nullopt;
  double nominal_s = 0;
  const std::optional<double> number = measured(gyro, axis, nominal_s);
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

// The described rate of frames.

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
