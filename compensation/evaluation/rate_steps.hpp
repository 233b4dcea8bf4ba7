// SPDX-License-Identifier: MIT
// Permanent steps of the rate: the gyro was moved.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace prism::evaluation {

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
