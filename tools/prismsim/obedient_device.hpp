// SPDX-License-Identifier: MIT
// The side of the device in a description's commands: streams only when started, answers only when asked.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/wire/description/commands.hpp"

namespace prism::prismsim {

/// Recognises the start, stop and poll commands by their bytes. Not for a step without "send".
class ObedientDevice {
 public:
  explicit ObedientDevice(const wire::Commands& commands);

  /// Bytes from the reader; returns the expected answers of the recognised start and stop commands.
  std::vector<std::uint8_t> received(std::span<const std::uint8_t> bytes);
  /// A reader opened the line: the device was switched on again.
  void restart();
  /// True if it sends this frame: all frames while streaming, or one for each request.
  bool sends_frame();
  bool is_asked() const { return asked_ > 0; }

 private:
  bool ends_with(const wire::CommandBytes& command) const;
  void follow(const std::vector<wire::Command>& steps, std::size_t& next, std::vector<std::uint8_t>& answers);

  const std::vector<wire::Command> start_, stop_;
  const std::vector<wire::PollRequest> requests_;
  std::vector<std::uint8_t> heard_;  ///< the last 4096 bytes, at most since the last request
  std::size_t start_step_ = 0, stop_step_ = 0, asked_ = 0;
};

}  // namespace prism::prismsim
