// SPDX-License-Identifier: MIT
// Irregularities of a series: runs of values far from those before and after them or without any change, and steps that
// stay.
#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace prism::evaluation {

/// Means of equal values differ in their last bits.
inline bool equal_means(double a, double b) { return std::fabs(a - b) <= 1e-9 * std::fmax(std::fabs(a), std::fabs(b)); }

/// Values [begin, end) of a series.
struct FarRun {
  std::size_t begin = 0, end = 0;
  double level = 0;  ///< median, or that of the largest part
  double rest = 0;   ///< median of the values next to the run
  double distance() const { return std::fabs(level - rest); }
};

/// In the unit of the values.
struct FarLimits {
  double far = 0;            ///< > 0: least step at both ends of a run, and least distance
  double absurd = HUGE_VAL;  ///< a run at a larger distance may have any length
  std::size_t longest = 0;   ///< most values of a run that is neither absurd nor constant
  /// A constant run may have any length, if the values before it change; those after it may be at another level.
  bool any_constant = false;
  double code = 0;  ///< > 0: the least step and distance of three or more runs of exactly one value: a code
};

inline constexpr std::size_t kFewRuns = 5;

/// Runs between two steps above `far`, after which the values are as before, of at most half of the values. A step that
/// stays begins none. A run at the start or end of the series needs one step only. Finite values. None at all if there
/// are more than kFewRuns with several levels: then the values change so. Many of one level are a code for "no value",
/// as 0 in a few rows, for which `code` is enough.
std::vector<FarRun> far_runs(std::span<const double> values, const FarLimits& limits);

/// Values [begin, end) that are equal.
struct ConstantRun {
  std::size_t begin = 0, end = 0;
  /// Nine tenths of the other values are in runs of at most a fiftieth of its length, and at most one in 200 of them is
  /// equal to it: the source has stopped. Else the resolution may be coarse and the quantity constant.
  bool certain = false;
};

/// Runs of at least `least` equal values, if not all values are equal. Finite values. Of many values only some evenly
/// spaced ones are compared with those of a run.
std::vector<ConstantRun> constant_runs(std::span<const double> values, std::size_t least);

/// sd of the white part by the steps between neighbours, without equal ones; 0: all are equal. Of many values some
/// evenly spaced steps are used.
double noise_of_steps(std::span<const double> values);

/// Median of at most 21 of the values [begin, end), evenly spaced.
double median_between(std::span<const double> values, std::size_t begin, std::size_t end);

// Permanent steps: the gyro was moved.

/// Minimum number of blocks of a part of a record that is judged by itself.
inline constexpr std::size_t kEnoughForPart = 12;

struct Step {
  double size = 0;        ///< in the unit of the blocks; 0: none
  std::size_t block = 0;  ///< the first one after it
};

/// Begins of the parts of a record without a gap of more than two blocks, and the number of blocks. `missing[i]`:
/// blocks missing before block i.
std::vector<std::size_t> parts_of(std::span<const double> missing);

/// Largest step within the parts. Parts of fewer than kEnoughForPart blocks between gaps are not judged, because there
/// a ramp looks like a step.
Step largest_step(std::span<const double> blocks, const std::vector<std::size_t>& parts);

/// The gap whose ends differ by more than `far` above the drift next to the gap, if drift elsewhere in the same time
/// does not explain it either.
Step largest_step_at_gaps(std::span<const double> blocks, std::span<const double> missing,
                          const std::vector<std::size_t>& parts, double far);

}  // namespace prism::evaluation
