// SPDX-License-Identifier: MIT
// Master of a pseudo-terminal that simulates a serial device; its link is removed with it.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/result.hpp"
#include "tools/prismsim/outlet.hpp"

namespace prism::prismsim {

class PseudoTerminal : public Outlet {
 public:
  /// Creates a terminal in raw mode; `link`, if not empty, becomes a symbolic link to it. Replaces an existing link;
  /// any other existing file is an error.
  static Result<PseudoTerminal> open(const std::string& link);

  PseudoTerminal(PseudoTerminal&& other) noexcept;
  PseudoTerminal& operator=(PseudoTerminal&&) = delete;
  /// Disconnects the reader and removes the link if it is still its own.
  ~PseudoTerminal() override;

  const std::string& path() const override { return path_; }

  /// True while a program has the other end open.
  bool has_reader() override;
  std::size_t write_some(std::span<const std::uint8_t> bytes) override;
  std::size_t read_some(std::span<std::uint8_t> bytes) override;
  void wait_for_room(int milliseconds) override;
  bool is_drained() override;

 private:
  PseudoTerminal(int master, std::string path) : master_(master), path_(std::move(path)) {}

  int master_ = -1;
  std::string path_, link_;
};

}  // namespace prism::prismsim
