// SPDX-License-Identifier: MIT
// Judges the seconds of a table before they are used: outliers, codes for "no value", sensors that have stopped.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "compensation/evaluation/far_runs.hpp"
#include "compensation/second_averager.hpp"

namespace prism::recordings {

/// Seconds `first` to `last`.
struct SecondRange {
  std::int64_t first = 0, last = 0;
};

struct JudgedSeconds {
  std::vector<std::string> notes;  ///< one line each
  /// Seconds whose values are explained by the notes, in order: rate, temperature, uhfo.
  std::array<std::vector<SecondRange>, 3> explained;
};

/// Makes values without information unknown, in each quantity: those far from all others (the rate by 50 times the
/// noise in at most 600 s and 5 % of the recording, or by 60 deg/h, which no turn of the gyro at rest explains; other
/// quantities if constant or absurd), for at most half of the recording; at most five runs, or any number with one
/// value, which may be nearer (8 times the noise). Then constant ones for which the source must have stopped. Values
/// after them that were rejected because they returned too fast are valid again. `is_date`: as end_of_second().
JudgedSeconds judge_seconds(std::vector<compensation::SecondMean>& second_means, bool is_date);

/// The limits for far values of a rate: means over `interval_s`, whose unit is unit_deg_per_h.
evaluation::FarLimits far_rate_limits(const std::vector<double>& rates, double unit_deg_per_h, double interval_s);
/// The remark on a run of them, in deg/h: `length` as in "5 s", and the times of its first and last value.
std::string far_rate_text(const evaluation::FarRun& run, const std::string& length, const std::string& first,
                          const std::string& last);

}  // namespace prism::recordings
