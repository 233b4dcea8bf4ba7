// SPDX-License-Identifier: MIT
// Values in order, for a year and more of seconds: two to three bytes a value, without a loss.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "compensation/evaluation/rate_source.hpp"
#include "tools/prismcal/recordings/packed_bits.hpp"

namespace prism::recordings {

/// Values with at most 6 decimals, as those of a log, or 9, and kUnknown are stored as integers of as many bits as the
/// range of 4096 neighbours needs; if one of these has another value, as they are.
class PackedSeries {
 public:
  void push(double value);
  /// From now on, each value is read as `factor` times the value that was pushed.
  void scale(double factor) { factor_ = factor; }
  std::size_t size() const { return size_; }
  double operator[](std::size_t index) const;
  /// Reads the values from `first` on; first + values.size() <= size().
  void read(std::size_t first, std::span<double> values) const;
  /// Frees the memory of the values, which must not be read any more. The size remains.
  void drop() { blocks_ = {}, open_ = {}; }
  /// Frees the memory of the values before `index`, except some thousands. They must not be read any more.
  void drop_before(std::size_t index);
  /// The series as a source, which uses it.
  evaluation::RateSource source() const;

 private:
  static constexpr std::size_t kBlock = evaluation::kRatePiece;
  struct Block {
    PackedBits numbers;  ///< integers from `base` on, or the bits of doubles
    std::int64_t base = 0;
    double per_unit = 0;  ///< integers of a value of 1; 0: doubles
  };
  static Block packed(const std::vector<double>& values);
  void unpack(const Block& block, std::size_t first, std::span<double> values) const;

  std::vector<Block> blocks_;  ///< all of kBlock values
  std::vector<double> open_;   ///< the values after them
  double factor_ = 1;
  std::size_t size_ = 0, dropped_ = 0;  ///< dropped_: blocks
};

}  // namespace prism::recordings
