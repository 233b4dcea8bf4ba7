// SPDX-License-Identifier: MIT
// The master's end of a pseudo-terminal that plays a serial device, with a name that outlives it not.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/result.hpp"

namespace prism::prismsim {

class PseudoTerminal {
 public:
  /// A new terminal, raw before anybody opens it; `link`, where not empty, becomes a symbolic link to it. A link that
  /// is there is replaced, anything else there is a refusal.
  static Result<PseudoTerminal> open(const std::string& link);

  PseudoTerminal(PseudoTerminal&& other) noexcept;
  PseudoTerminal& operator=(PseudoTerminal&&) = delete;
  /// Hangs the reader up and takes the link away, if it is still ours.
  ~PseudoTerminal();

  const std::string& path() const { return path_; }

  /// True while some program has the other end open.
  bool has_reader() const;

  /// Writes what there is room for without waiting; the number of bytes taken.
  std::size_t write_some(std::span<const std::uint8_t> bytes);
  /// Waits until there is room or the time is over (or a signal came).
  void wait_for_room(int milliseconds) const;
  /// True where the reader has taken everything, or nobody reads.
  bool is_drained() const;

 private:
  PseudoTerminal(int master, std::string path) : master_(master), path_(std::move(path)) {}

  int master_ = -1;
  std::string path_, link_;
};

}  // namespace prism::prismsim
