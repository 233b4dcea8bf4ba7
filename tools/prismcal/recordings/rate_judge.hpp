// SPDX-License-Identifier: MIT
// Judges the rates of a table before their Allan deviation is computed, as second_judge.hpp does for a training.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tools/prismcal/tables/plain_table.hpp"

namespace prism::recordings {

struct RateJudgement {
  double unit_deg_per_h = 1;                            ///< of a value of 1
  double interval_s = 1;                                ///< about, between two rows
  std::function<std::string(std::size_t row)> time_of;  ///< in remarks
};

/// For the rows of a table with these times; empty: without. `stamps_ns` must outlive the result.
RateJudgement judgement_of(const tables::PlainTable& table, double unit_deg_per_h, std::size_t rows,
                           const std::vector<std::int64_t>& stamps_ns);

/// Makes values without information unknown: those far from all others, by the rules of judge_seconds() for a rate, and
/// constant ones for which the source must have stopped. Returns one remark for each run. Long series are searched in
/// blocks of rows, then the rows of the blocks that were found.
std::vector<std::string> judge_rates(std::vector<double>& rates, const RateJudgement& judgement);

}  // namespace prism::recordings
