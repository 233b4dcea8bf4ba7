// SPDX-License-Identifier: MIT
#include "drivers/counter_check.hpp"

#include <utility>

namespace prism::drivers {

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

}  // namespace prism::drivers
