// SPDX-License-Identifier: MIT
// Gross outliers of the target: removed before a robust training, so that its start does not depend on them.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "compensation/training/held_out.hpp"

namespace prism::training {

inline constexpr double kGross = 60;
/// Simulated gyros without outliers stay below 5, real chamber records do not.
inline constexpr double kSuspect = 8;

/// Rows whose target is far from the median of the 65 rows around them in their recording, and from that of the 65 rows
/// with the nearest inputs: more than `scales` robust scales (MAD) of all such distances, both times. In order. Clean
/// records stay below 41 (docs/compensation.md); smaller outliers are left to the robust weights. None with fewer than
/// 20 rows. An excursion of the inputs that is unique and shorter than 30 rows counts as well. `inputs` is d × N;
/// `runs`: recording of each row. O(N · min(N, 2000)).
Rows gross_outliers(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& target, const std::vector<int>& runs,
                    double scales = kGross);

/// Rows counted from 1, as ranges: "12, 50 to 57 and 3 others".
std::string rows_text(const Rows& rows);

}  // namespace prism::training
