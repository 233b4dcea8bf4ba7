// SPDX-License-Identifier: MIT
#include "drivers/counter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace prism::drivers {
namespace {

/// After a longer time without data the counter may have wrapped unseen; shorter gaps may be a stalled machine.
constexpr double kWrapUnseenS = 1;
/// This many bytes at once were waiting to be read.
constexpr std::uint32_t kBacklogBytes = 1024;
/// A restart can be distinguished from lost frames only if the counter covers this many frames.
constexpr double kTellingFrames = 64;

std::uint32_t whole(double frames) { return static_cast<std::uint32_t>(std::llround(std::clamp(frames, 0.0, 4e9))); }

}  // namespace

CounterCheck::CounterCheck(wire::FrameDescriptionPtr description) : rule_(description->counter) {
  if (rule_)
    near_ticks_ =
        kNearFrames * (rule_->step_varies ? rule_->ticks_per_s * description->period_s() : rule_->ticks_per_frame);
}

std::span<const wire::DecodedMessage> CounterCheck::decide(const wire::DecodedMessage& reading) {
  std::size_t passed = 0;
  if (const auto held = std::exchange(held_, std::nullopt)) {
    if (rule_->ticks_between(*last_, held->counter) <= rule_->ticks_between(*last_, reading.counter)) {
      passed_[passed++] = *held;
      last_ = held->counter;
    } else {
      ++rejected_;
    }
  }
  if (is_near(reading.counter)) {
    passed_[passed++] = reading;
    last_ = reading.counter;
  } else {
    held_ = reading;
  }
  return {passed_.data(), passed};
}

std::span<const wire::DecodedMessage> CounterCheck::finish() {
  last_.reset();
  if (!held_) return {};
  passed_[0] = *std::exchange(held_, std::nullopt);
  return {passed_.data(), 1};
}

bool waited_to_be_read(const wire::DecodedMessage& reading, double period_s, double elapsed_s) {
  const double waited_s = static_cast<double>(reading.behind) / reading.length * period_s;
  return reading.behind >= kBacklogBytes || waited_s > elapsed_s / 2;
}

CounterUnwrapper::CounterUnwrapper(wire::FrameDescriptionPtr description, bool by_arrival)
    : description_(std::move(description)), by_arrival_(by_arrival) {}

void CounterUnwrapper::reset() {
  running_ = false;
  last_counter_.reset();
}

CounterStep CounterUnwrapper::push(const wire::DecodedMessage& reading, double slope) {
  const CounterStep step = running_ ? step_to(reading, slope) : CounterStep{};
  running_ = true;
  last_arrival_ns_ = reading.arrival_ns;
  if (reading.has_counter) last_counter_ = reading.counter;
  return step;
}

double CounterUnwrapper::frame_ticks() const {
  if (!description_->counter) return 1;
  const wire::CounterRule& rule = *description_->counter;
  return last_counter_ ? rule.ticks_per_frame : rule.ticks_per_s * description_->period_s();
}

double CounterUnwrapper::unseen_ticks() const {
  if (!last_counter_) return frame_ticks();
  const wire::CounterRule& rule = *description_->counter;
  return rule.step_varies ? 0 : static_cast<double>(rule.modulus);
}

std::uint32_t CounterUnwrapper::frames_of(double ticks) const { return whole(ticks / frame_ticks()); }

/// Counter periods during a time without data.
double CounterUnwrapper::unseen_turns(const wire::DecodedMessage& reading, double ticks, double slope) const {
  const wire::CounterRule& rule = *description_->counter;
  const double elapsed_s = 1e-9 * static_cast<double>(reading.arrival_ns - last_arrival_ns_);
  if (rule.modulus == 0 || !by_arrival_ || elapsed_s <= kWrapUnseenS) return 0;
  if (waited_to_be_read(reading, description_->period_s(), elapsed_s)) return 0;
  return std::max(0.0, std::round((elapsed_s * rule.ticks_per_s / slope - ticks) / static_cast<double>(rule.modulus)));
}

CounterStep CounterUnwrapper::uncounted(const wire::DecodedMessage& reading) const {
  CounterStep step;
  if (!reading.has_gyro || last_counter_) return step;
  step.ticks = (1.0 + reading.damaged) * frame_ticks();
  step.missing = reading.damaged;
  return step;
}

CounterStep CounterUnwrapper::step_to(const wire::DecodedMessage& reading, double slope) const {
  if (!reading.has_counter || !last_counter_) return uncounted(reading);
  const wire::CounterRule& rule = *description_->counter;
  CounterStep step;
  step.ticks = static_cast<double>(rule.ticks_between(*last_counter_, reading.counter));
  const double unseen = unseen_turns(reading, step.ticks, slope) * static_cast<double>(rule.modulus);
  step.ticks += unseen;
  step.duplicate = step.ticks == 0;
  const double modulus = rule.modulus == 0 ? 0x1p64 : static_cast<double>(rule.modulus);
  if (!by_arrival_ && modulus / rule.ticks_per_frame >= kTellingFrames && step.ticks > modulus / 2) {
    step.restarted = true;
    step.ticks = rule.ticks_per_frame;
  }
  if (rule.step_varies) return step;
  step.missing = whole(step.ticks / rule.ticks_per_frame - 1);
  step.by_arrival = std::min(step.missing, frames_of(unseen));
  return step;
}

}  // namespace prism::drivers
