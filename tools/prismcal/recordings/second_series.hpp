// SPDX-License-Identifier: MIT
// A rate per second, for a year and more: two to three bytes a value, without a loss.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace prism::recordings {

/// Seconds in increasing order, each with a rate or kUnknown. Rates with at most 6 decimals, as those of a log, are
/// stored as integers of as many bits as the range of 4096 neighbours needs; others as they are.
class SecondSeries {
 public:
  void push(std::int64_t second, double rate);

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  std::int64_t first_second() const { return runs_.front().second; }  ///< requires !empty()
  std::int64_t last_second() const;                                   ///< requires !empty()
  /// By index, < size().
  double rate(std::size_t index) const;
  std::int64_t second(std::size_t index) const;
  /// The index of a second; nullopt if the series does not have it.
  std::optional<std::size_t> find(std::int64_t second) const;

  /// Calls visit(second, rate) for each in order: faster than by index.
  template <class Visit>
  void for_each(Visit&& visit) const {
    std::size_t run = 0;
    std::vector<double> rates;
    for (std::size_t begin = 0; begin < size_; begin += rates.size()) {
      decode(begin / kBlock, rates);
      for (std::size_t i = 0; i < rates.size(); ++i) {
        while (run + 1 < runs_.size() && runs_[run + 1].index <= begin + i) ++run;
        visit(runs_[run].second + static_cast<std::int64_t>(begin + i - runs_[run].index), rates[i]);
      }
    }
  }

 private:
  static constexpr std::size_t kBlock = 4096;
  struct Block {
    std::vector<std::uint64_t> words;  ///< integers of `bits` bits, or the bits of doubles
    std::int64_t base = 0;             ///< smallest integer, in 1e-6
    unsigned bits = 64;                ///< 64: doubles
    std::uint64_t integer(std::size_t i) const;
  };
  /// Consecutive seconds.
  struct Run {
    std::int64_t second = 0;
    std::size_t index = 0;  ///< of the first of them
  };
  static Block packed(const std::vector<double>& rates);
  static double value(const Block& block, std::size_t i);
  void decode(std::size_t block, std::vector<double>& rates) const;

  std::vector<Block> blocks_;  ///< all of kBlock values
  std::vector<double> open_;   ///< the values after them
  std::vector<Run> runs_;
  std::size_t size_ = 0;
};

}  // namespace prism::recordings
