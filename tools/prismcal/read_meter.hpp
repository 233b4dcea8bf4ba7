// SPDX-License-Identifier: MIT
// How far files are read, for a progress bar.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>

namespace prism::tables {

struct ReadState {
  std::uint64_t bytes = 0, of_bytes = 0;  ///< of all files that are read together
  std::uint64_t rows = 0;                 ///< or packets
};

/// Called several times a second while files are read, and at their end. May be empty.
using ReadProgress = std::function<void(const ReadState&)>;

/// Counts what is read, and reports it.
class ReadMeter {
 public:
  explicit ReadMeter(ReadProgress report = {}, std::uint64_t of_bytes = 0) : report_(std::move(report)) {
    state_.of_bytes = of_bytes;
  }
  void add_bytes(std::uint64_t bytes) {
    state_.bytes += bytes;
    if (report_) report_(state_);
  }
  void add_rows(std::uint64_t rows) { state_.rows += rows; }
  /// Sets the state, for readers that know their position.
  void set(std::uint64_t bytes, std::uint64_t rows) {
    state_.rows = rows;
    add_bytes(bytes - state_.bytes);
  }

 private:
  ReadProgress report_;
  ReadState state_;
};

}  // namespace prism::tables
