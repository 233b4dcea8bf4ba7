// SPDX-License-Identifier: MIT
// Bias stability as in laser-gyro practice: the standard deviation of non-overlapping 100 s means.
#pragma once

#include <cstdint>
#include <optional>

#include "compensation/compensated.hpp"

namespace prism::compensation {

/// Running mean and variance of one series (Welford 1962), numerically safe for long records.
class RunningVariance {
 public:
  void add(double value);
  std::int64_t count() const { return count_; }
  double mean() const { return count_ > 0 ? mean_ : kUnknown; }
  /// Standard deviation with divisor N − 1; kUnknown for fewer than two values.
  double sd() const;

 private:
  std::int64_t count_ = 0;
  double mean_ = 0, squares_ = 0;
};

/// Takes the windows of a run and keeps those that end a block of length_s seconds: the paper's sample grid. Raw and
/// corrected values use the same blocks, so that their ratio is meaningful. Uses constant memory.
class BlockStability {
 public:
  void add(const CompensatedWindow& row, int length_s);
  void reset() { *this = BlockStability(); }

  const RunningVariance& raw() const { return raw_; }              ///< blocks with a correction only
  const RunningVariance& corrected() const { return corrected_; }  ///< the same blocks, corrected
  const RunningVariance& all() const { return all_; }              ///< every full block, raw
  /// (raw − corrected) / raw, 1 = all removed. Returns nullopt for fewer than two blocks or a constant raw rate.
  std::optional<double> improvement() const;

 private:
  std::optional<std::int64_t> next_end_;
  RunningVariance raw_, corrected_, all_;
};

}  // namespace prism::compensation
