// SPDX-License-Identifier: MIT
#include "drivers/poller.hpp"

#include <algorithm>
#include <utility>

namespace prism::drivers {

void Poller::begin(Time now) {
  if (!std::exchange(begun_, true)) {
    round_ = deadline_ = now;
    return;
  }
  if (waiting_) ++counters_.missed;
  if (waiting_ || request_ > 0) end_round(now);  // the line was lost within a round
  waiting_ = false;
  deadline_ = std::max(now, round_);
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
  end_round(deadline_);
  deadline_ = std::max(deadline_, round_);
}

void Poller::end_round(Time now) {
  request_ = 0;
  round_ += poll_.every;
  if (round_ + poll_.every <= now) {
    const auto late = (now - round_) / poll_.every;
    counters_.skipped += static_cast<std::uint64_t>(late);
    round_ += late * poll_.every;
  }
}

}  // namespace prism::drivers
