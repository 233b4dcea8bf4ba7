// SPDX-License-Identifier: MIT
#include "drivers/commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace prism::drivers {
namespace {

constexpr std::size_t kShown = 16;

std::string hex_text(std::span<const std::uint8_t> bytes) { return fmt::format("{:02X}", fmt::join(bytes, " ")); }

}  // namespace

std::string bytes_text(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty() && (bytes.back() == '\r' || bytes.back() == '\n')) bytes = bytes.first(bytes.size() - 1);
  const bool plain = std::all_of(bytes.begin(), bytes.end(), [](std::uint8_t c) { return c >= 0x20 && c <= 0x7e; });
  return plain && !bytes.empty() ? std::string(bytes.begin(), bytes.end()) : hex_text(bytes);
}

std::span<const std::uint8_t> StartUp::proceed(Time now) {
  while (!is_done() && !failed_) {
    const wire::Command& step = steps_[step_];
    if (!sent_) {
      sent_ = true;
      answered_ = false;
      answer_bytes_ = 0;
      last_bytes_.clear();
      deadline_ = now + (step.expect.empty() ? step.wait : step.within);
      if (!step.send.empty()) return step.send;
    }
    if (!answered_ && now < deadline_) return {};
    failed_ = !answered_ && !step.expect.empty();
    if (failed_) return {};
    ++step_;
    sent_ = false;
  }
  return {};
}

void StartUp::received(std::span<const std::uint8_t> bytes) {
  if (is_done() || !sent_ || answered_) return;
  const wire::CommandBytes& expected = steps_[step_].expect;
  answer_bytes_ += bytes.size();
  last_bytes_.insert(last_bytes_.end(), bytes.begin(), bytes.end());
  answered_ = !expected.empty() && std::search(last_bytes_.begin(), last_bytes_.end(), expected.begin(),
                                               expected.end()) != last_bytes_.end();
  if (last_bytes_.size() > wire::kMostExpectedBytes)
    last_bytes_.erase(last_bytes_.begin(), last_bytes_.end() - wire::kMostExpectedBytes);
}

std::string StartUp::text() const {
  std::string text = fmt::format("step {} of {}", std::min(step_ + 1, steps_.size()), steps_.size());
  if (!failed_) return text;
  text += fmt::format(": expected {}, received ", bytes_text(steps_[step_].expect));
  if (last_bytes_.empty()) return text + "nothing";
  const std::size_t shown = std::min(last_bytes_.size(), kShown);
  if (answer_bytes_ > shown) text += fmt::format("{} bytes, the last ", answer_bytes_);
  return text + hex_text(std::span(last_bytes_).last(shown));
}

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
