// SPDX-License-Identifier: MIT
// Unwrapping the counter.
#include "drivers/frame_steps.hpp"

#include <algorithm>
#include <cmath>

namespace prism::drivers {
namespace {

/// The silence behind which the counter may have wrapped unseen; shorter ones may be a stalled machine.
constexpr double kWrapUnseenS = 1;
/// A backward jump is told from lost frames only where the counter holds this many frames.
constexpr double kTellingFrames = 64;

/// Of the nearest whole number of frames.
std::uint32_t frames_between(double frames) {
  return static_cast<std::uint32_t>(std::llround(std::clamp(frames - 1, 0.0, 4e9)));
}

}  // namespace

FrameSteps::FrameSteps(wire::FrameDescriptionPtr description, bool by_arrival)
    : description_(std::move(description)), by_arrival_(by_arrival) {}

void FrameSteps::reset() {
  running_ = false;
  last_counter_.reset();
}

FrameStep FrameSteps::push(const wire::Reading& reading, double slope) {
  const FrameStep step = running_ ? step_to(reading, slope) : FrameStep{};
  running_ = true;
  last_ = reading;
  if (reading.has_counter) last_counter_ = reading.counter;
  return step;
}

double FrameSteps::counted_ticks(const wire::Reading& reading, double slope) const {
  const wire::CounterRule& rule = *description_->counter;
  std::uint64_t ticks = reading.counter - *last_counter_;
  if (rule.modulus == 0) return static_cast<double>(ticks);
  if (reading.counter < *last_counter_) ticks += rule.modulus;
  const double elapsed_s = 1e-9 * static_cast<double>(reading.arrival_ns - last_.arrival_ns);
  if (!by_arrival_ || elapsed_s <= kWrapUnseenS) return static_cast<double>(ticks);
  const double modulus = static_cast<double>(rule.modulus);
  const double turns = std::round((elapsed_s * rule.ticks_per_s / slope - static_cast<double>(ticks)) / modulus);
  return static_cast<double>(ticks) + std::max(0.0, turns) * modulus;
}

double FrameSteps::frames_by_offset(const wire::Reading& reading) const {
  const std::uint64_t end = last_.offset + last_.length;
  if (description_->kinds.size() != 1 || reading.offset <= end) return 1;
  return 1 + std::round(static_cast<double>(reading.offset - end) / reading.length);
}

FrameStep FrameSteps::uncounted(const wire::Reading& reading) const {
  FrameStep step;
  if (!reading.has_gyro || last_counter_) return step;
  const double frames = frames_by_offset(reading);
  step.ticks = frames * (description_->counter ? description_->counter->ticks_per_s * description_->period_s() : 1);
  step.missing = frames_between(frames);
  return step;
}

FrameStep FrameSteps::step_to(const wire::Reading& reading, double slope) const {
  if (!reading.has_counter || !last_counter_) return uncounted(reading);
  const wire::CounterRule& rule = *description_->counter;
  FrameStep step;
  step.ticks = counted_ticks(reading, slope);
  step.duplicate = step.ticks == 0;
  const double modulus = rule.modulus == 0 ? 0x1p64 : static_cast<double>(rule.modulus);
  if (!by_arrival_ && modulus / rule.ticks_per_frame >= kTellingFrames && step.ticks > modulus / 2) {
    step.restarted = true;
    step.ticks = rule.ticks_per_frame;
  }
  if (!rule.step_varies) step.missing = frames_between(step.ticks / rule.ticks_per_frame);
  return step;
}

}  // namespace prism::drivers
