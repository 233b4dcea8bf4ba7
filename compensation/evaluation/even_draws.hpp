// SPDX-License-Identifier: MIT
// Evenly spread normal numbers: the distribution of a function of a few of them with fewer draws than by chance.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace prism::evaluation {

/// 1 024 draws of four independent normal numbers of mean 0 and sd 1, each with its negative: the points of Hammersley
/// (1960), in bases 2, 3 and 5. The share of draws on one side of a plane differs from its probability by less than
/// 0.02, near the middle of the distribution. Computed once; thread-safe.
const std::vector<Eigen::Vector4d>& even_normal_draws();

}  // namespace prism::evaluation
