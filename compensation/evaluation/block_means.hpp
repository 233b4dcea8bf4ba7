// SPDX-License-Identifier: MIT
// Means over non-overlapping blocks of time: from 1 s rows to the grid of the bias stability.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::evaluation {

/// One value and the time of the end of its interval.
struct TimedValue {
  double time_s = 0;
  double value = 0;
};

struct BlockMeans {
  double length_s = 0;
  std::vector<double> time_s;    ///< end of each block
  std::vector<double> mean;      ///< same length as time_s; all finite
  std::vector<bool> follows;     ///< block i begins at the end of block i − 1: their difference is valid
  std::size_t rows = 0;          ///< rows in blocks
  std::size_t rows_left = 0;     ///< finite rows outside all complete blocks: around gaps and at the end
  std::size_t rows_unknown = 0;  ///< rows whose value was not finite
  std::size_t gaps = 0;          ///< gaps longer than max_gap_s; the grid restarts after each
  double longest_gap_s = 0;
};

/// Groups rows spaced by `row_s` into blocks of `length_s`. The grid starts at the first row and restarts after every
/// gap: a block never spans a gap longer than `max_gap_s`. Leaves out blocks with less than half of their rows. Errors:
/// no rows; times that do not increase; row_s or length_s not positive; length_s below row_s.
Result<BlockMeans> mean_over_blocks(std::span<const TimedValue> rows, double row_s, double length_s, double max_gap_s,
                                    const std::string& where);

}  // namespace prism::evaluation
