// SPDX-License-Identifier: MIT
// Runs the commands of a description: what to send when, and whether the answers are right.
#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/wire/description/commands.hpp"

namespace prism::drivers {

/// The steps in their order, once. Sends, waits and reads the time by its caller. Stores at most 64 received bytes.
class StartUp {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit StartUp(std::vector<wire::Command> steps) : steps_(std::move(steps)) {}

  /// Goes on as far as possible. Returns the bytes to send now; call it again until it returns none, then at the
  /// latest at deadline(), and after received().
  std::span<const std::uint8_t> proceed(Time now);
  /// Bytes of the device, which may also be data.
  void received(std::span<const std::uint8_t> bytes);

  bool is_done() const { return step_ == steps_.size(); }
  bool has_failed() const { return failed_; }
  /// When the current step ends.
  Time deadline() const { return deadline_; }
  /// "step 2 of 5"; after a failure "step 2 of 5: expected OK, received 45 52 52".
  std::string text() const;

 private:
  std::vector<wire::Command> steps_;
  std::size_t step_ = 0;
  bool sent_ = false, answered_ = false, failed_ = false;
  std::uint64_t answer_bytes_ = 0;        ///< since the step began
  std::vector<std::uint8_t> last_bytes_;  ///< of the answer
  Time deadline_;
};

/// "OK", or bytes in hex if they are not printable.
std::string bytes_text(std::span<const std::uint8_t> bytes);

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
