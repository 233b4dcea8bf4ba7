// SPDX-License-Identifier: MIT
#include "drivers/counter_check.hpp"

namespace prism::drivers {

CounterCheck::CounterCheck(wire::FrameDescriptionPtr description) : applies_(description->counter.has_value()) {
  if (!applies_) return;
  const wire::CounterRule& rule = *description->counter;
  modulus_ = rule.modulus;
  near_ticks_ = kNearFrames * (rule.step_varies ? rule.ticks_per_s * description->period_s() : rule.ticks_per_frame);
}

double CounterCheck::ticks_after_last(std::uint64_t counter) const {
  std::uint64_t ticks = counter - *last_;
  if (modulus_ != 0 && counter < *last_) ticks += modulus_;
  return static_cast<double>(ticks);
}

void CounterCheck::take(const wire::DecodedMessage& reading, std::vector<wire::DecodedMessage>& passed) {
  if (held_) {
    if (ticks_after_last(held_->counter) <= ticks_after_last(reading.counter)) {
      passed.push_back(*held_);
      last_ = held_->counter;
    } else {
      ++rejected_;
    }
    held_.reset();
  }
  if (passes(reading)) {
    passed.push_back(reading);
  } else {
    held_ = reading;
  }
}

void CounterCheck::finish(std::vector<wire::DecodedMessage>& passed) {
  if (held_) passed.push_back(*held_);
  reset();
}

void CounterCheck::reset() {
  last_.reset();
  held_.reset();
}

}  // namespace prism::drivers
