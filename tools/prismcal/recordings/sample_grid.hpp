// SPDX-License-Identifier: MIT
// The sample time of a series, and its lost samples, from time stamps that may be coarse, batched, alternating or
// jittered.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismcal/recordings/packed_stamps.hpp"

namespace prism::recordings {

struct SampleHole {
  std::size_t row = 0;   ///< first row after the hole, from 0
  std::size_t lost = 0;  ///< samples
};

struct SampleGrid {
  double interval_s = 0;
  std::vector<SampleHole> holes;                            ///< in order of rows
  std::size_t lost = 0;                                     ///< in all holes
  std::size_t repeated = 0;                                 ///< stamps equal to the one before
  double mean_step_s = 0, median_step_s = 0, jitter_s = 0;  ///< jitter: of the stamps around the grid
  bool regular = true;  ///< each step is the interval, a hole, or 0 of one of few rows that repeat a time, within 1 %
  /// How the interval was found, and why; empty if the stamps are regular and mean and median step agree within 1 %.
  std::string remark;

  /// Times on the grid, in ns: the stamps without their jitter; the stamps themselves if they are regular and exact to
  /// 1 ns, or rows repeat a time: then 1 ns later than the row before. `stamps_ns`: those of sample_grid().
  PackedStamps times_ns(const PackedStamps& stamps_ns) const;
};

/// Stamps are ends of intervals, never early and possibly late (USB, operating system), or rounded. The sample time is
/// the count over the span of the runs between holes. A hole is a lasting shift of the stamps against the count:
/// its lower envelope rises and stays (as LowerHull, drivers/clock.hpp); a late stamp is followed by one that is
/// not. A hole within a batch of equal stamps is placed at its first row. Stamps whose resolution is near the sample
/// time, or coarser, jump at even distances without a loss (uniform_stamps.hpp). If nearly all steps are equal, they
/// are the sample time, and a few rows that repeat the time of the row before do not change it. `interval_s`: the true
/// sample time, if it is known. Errors: fewer than two stamps; one that is earlier than the one before, with its row
/// from 1 in the place; the same time in all rows, or in most. Memory: little more than that of the stamps.
Result<SampleGrid> sample_grid(const PackedStamps& stamps_ns, const std::string& where,
                               std::optional<double> interval_s = std::nullopt);

}  // namespace prism::recordings
