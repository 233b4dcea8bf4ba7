// SPDX-License-Identifier: MIT
// Master of a pseudo-terminal that simulates a serial device; its link is removed with it.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/result.hpp"

namespace prism::prismsim {

class PseudoTerminal {
 public:
  /// Creates a terminal in raw mode; `link`, if not empty, becomes a symbolic link to it. Replaces an existing link;
  /// any other existing file is an error.
  static Result<PseudoTerminal> open(const std::string& link);

  PseudoTerminal(PseudoTerminal&& other) noexcept;
  PseudoTerminal& operator=(PseudoTerminal&&) = delete;
  /// Disconnects the reader and removes the link if it is still its own.
  ~PseudoTerminal();

  const std::string& path() const { return path_; }

  /// True while a program has the other end open.
  bool has_reader() const;

  /// Writes as much as fits without waiting; returns the number of bytes.
  std::size_t write_some(std::span<const std::uint8_t> bytes);
  /// Waits for space, at most the given time; a signal ends it, too.
  void wait_for_room(int milliseconds) const;
  /// Returns true if the reader has read everything, or there is no reader.
  bool is_drained() const;

 private:
  PseudoTerminal(int master, std::string path) : master_(master), path_(std::move(path)) {}

  int master_ = -1;
  std::string path_, link_;
};

}  // namespace prism::prismsim
