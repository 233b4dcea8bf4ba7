// SPDX-License-Identifier: MIT
#include "drivers/poller.hpp"

#include <algorithm>

namespace prism::drivers {

void Poller::begin(Time now) {
  request_ = 0;
  waiting_ = false;
  round_ = deadline_ = now;
}

std::span<const std::uint8_t> Poller::proceed(Time now) {
  if (now < deadline_) return {};
  if (waiting_) {
    ++counters_.missed;
    next(now);
    if (now < deadline_) return {};
  }
  const wire::PollRequest& request = poll_.requests[request_];
  ++counters_.requests;
  waiting_ = true;
  deadline_ = now + request.within;
  return request.send;
}

void Poller::replied(Time now) {
  if (waiting_) next(now);
}

void Poller::next(Time now) {
  waiting_ = false;
  deadline_ = now + poll_.pause;
  if (++request_ < poll_.requests.size()) return;
  request_ = 0;
  round_ += poll_.every;
  if (round_ + poll_.every <= deadline_) {
    const auto late = (deadline_ - round_) / poll_.every;
    counters_.skipped += static_cast<std::uint64_t>(late);
    round_ += late * poll_.every;
  }
  deadline_ = std::max(deadline_, round_);
}

}  // namespace prism::drivers
