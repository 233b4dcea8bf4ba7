// SPDX-License-Identifier: MIT
// Runs start-up or stop commands: what to send now, and whether the answers are right.
#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <string>
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

}  // namespace prism::drivers
