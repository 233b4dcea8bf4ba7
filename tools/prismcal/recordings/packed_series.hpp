// SPDX-License-Identifier: MIT
// Values in order, for a year and more of seconds: two to three bytes a value, without a loss.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "compensation/evaluation/rate_source.hpp"

namespace prism::recordings {

/// Values with at most 6 decimals, as those of a log, and kUnknown are stored as integers of as many bits as the range
/// of 4096 neighbours needs; if one of these has another value, as they are.
class PackedSeries {
 public:
  void push(double value);
  std::size_t size() const { return size_; }
  double operator[](std::size_t index) const;
  /// Reads the values from `first` on; first + values.size() <= size().
  void read(std::size_t first, std::span<double> values) const;
  /// Frees the memory of the values, which must not be read any more. The size remains.
  void drop() { blocks_ = {}, open_ = {}; }
  /// The series as a source, which uses it.
  evaluation::RateSource source() const;

 private:
  static constexpr std::size_t kBlock = evaluation::kRatePiece;
  struct Block {
    std::vector<std::uint64_t> words;  ///< integers of `bits` bits and an unused word, or the bits of doubles
    std::int64_t base = 0;             ///< smallest integer, in 1e-6
    unsigned bits = 64;                ///< 64: doubles
  };
  static Block packed(const std::vector<double>& values);
  static void unpack(const Block& block, std::size_t first, std::span<double> values);

  std::vector<Block> blocks_;  ///< all of kBlock values
  std::vector<double> open_;   ///< the values after them
  std::size_t size_ = 0;
};

}  // namespace prism::recordings
