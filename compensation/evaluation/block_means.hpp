// SPDX-License-Identifier: MIT
// Means over blocks of time that do not overlap: 1 s rows in, the grid that bias stability is stated on out.
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
  std::vector<bool> follows;     ///< block i begins where block i − 1 ended: their difference means something
  std::size_t rows = 0;          ///< rows that went into blocks
  std::size_t rows_left = 0;     ///< finite rows in no full block: around gaps and at the end
  std::size_t rows_unknown = 0;  ///< rows whose value was not finite: a hole in the series
  std::size_t gaps = 0;          ///< holes longer than max_gap_s; the grid begins anew after each
  double longest_gap_s = 0;
};

/// Rows spaced by `row_s` are gathered into blocks of `length_s`, counted from the first row and anew after every gap:
/// a block never spans a hole longer than `max_gap_s`. A block with less than half of its rows is left out.
/// Refused: no rows; times that do not increase; row_s, length_s not positive; length_s below row_s.
Result<BlockMeans> mean_over_blocks(std::span<const TimedValue> rows, double row_s, double length_s, double max_gap_s,
                                    const std::string& where);

}  // namespace prism::evaluation
