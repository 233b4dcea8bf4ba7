// SPDX-License-Identifier: MIT
// Bytes for a device: start-up and stop commands, and requests of a device that answers only when asked.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/json_section.hpp"

namespace prism::wire {

using CommandBytes = std::vector<std::uint8_t>;

/// Longest Command::expect.
inline constexpr std::size_t kMostExpectedBytes = 64;

/// One step: sends `send`, if any; then waits for `expect`, at most `within`, or, without it, for the time `wait`.
struct Command {
  CommandBytes send, expect;
  std::chrono::milliseconds within{1000};  ///< 1 to 60 000
  std::chrono::milliseconds wait{0};       ///< 0 to 60 000

  bool operator==(const Command&) const = default;
};

/// A request and the time limit of its reply, which is any frame of the description.
struct PollRequest {
  CommandBytes send;
  std::chrono::milliseconds within{300};  ///< 1 to 60 000

  bool operator==(const PollRequest&) const = default;
};

/// All requests, in turn, once each period.
struct Poll {
  std::chrono::milliseconds every{1000};  ///< 10 to 3 600 000
  std::chrono::milliseconds pause{20};    ///< between a reply and the next request on a shared line, 0 to 60 000
  std::vector<PollRequest> requests;      ///< 1 to 64

  bool operator==(const Poll&) const = default;
};

/// Of a frame description, or the changes of a configuration: absent parts are as described.
struct Commands {
  std::optional<std::vector<Command>> start;  ///< after each opening of the line
  std::optional<std::vector<Command>> stop;   ///< at the end of the program
  std::optional<bool> again_when_silent;      ///< `start` again after silence_s without a frame
  std::optional<Poll> poll;

  /// These commands with the present parts of `changes`.
  Commands with(const Commands& changes) const;
  bool operator==(const Commands&) const = default;
};

/// The keys "start", "stop", "again_when_silent" and "poll".
const JsonTable<Commands>& command_keys();

}  // namespace prism::wire
