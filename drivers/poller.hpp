// SPDX-License-Identifier: MIT
// Asks a device that answers only when asked: which request is due when.
#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <utility>

#include "drivers/wire/description/commands.hpp"

namespace prism::drivers {

/// Counters of polls.
struct PollCounters {
  std::uint64_t requests = 0;
  std::uint64_t missed = 0;   ///< requests without a reply in time
  std::uint64_t skipped = 0;  ///< periods without a round, because the round before took longer
};

/// A round of all requests begins at the first begin() + n periods: delays do not accumulate, and a device that closes
/// its line after each reply is not asked more often. Sends and reads the time by its caller. Not for an empty poll.
class Poller {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit Poller(wire::Poll poll) : poll_(std::move(poll)) {}

  /// The line was opened (again) and has started: the first request is due now; later, at the next period.
  void begin(Time now);
  /// Returns the request to send now, or no bytes. Call it at deadline() and after replied().
  std::span<const std::uint8_t> proceed(Time now);
  /// A frame arrived: the reply, if a request waits for one.
  void replied(Time now);
  Time deadline() const { return deadline_; }
  const PollCounters& counters() const { return counters_; }
  const wire::Poll& poll() const { return poll_; }

 private:
  void next(Time now);
  void end_round(Time now);

  wire::Poll poll_;
  PollCounters counters_;
  std::size_t request_ = 0;
  bool waiting_ = false;  ///< for a reply
  bool begun_ = false;
  Time round_, deadline_;
};

}  // namespace prism::drivers
