// SPDX-License-Identifier: MIT
// Where the simulated gyro sends its bytes in real time: a pseudo-terminal or a network line.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace prism::prismsim {

class Outlet {
 public:
  virtual ~Outlet() = default;

  /// Name for messages: a path or an address.
  virtual const std::string& path() const = 0;
  /// True while a program reads the line. Connects again after a loss.
  virtual bool has_reader() = 0;
  /// Writes as much as fits without waiting; returns the number of bytes.
  virtual std::size_t write_some(std::span<const std::uint8_t> bytes) = 0;
  /// Reads what the reader sent, without waiting; returns the number of bytes.
  virtual std::size_t read_some(std::span<std::uint8_t> bytes) = 0;
  /// Waits for space, at most the given time; a signal ends it, too.
  virtual void wait_for_room(int milliseconds) = 0;
  /// Returns true if the reader has read everything, or there is no reader; of a network line it is not known: true.
  virtual bool is_drained() = 0;
};

}  // namespace prism::prismsim
