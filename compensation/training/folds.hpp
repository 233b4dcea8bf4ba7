// SPDX-License-Identifier: MIT
// Who is held out together: shuffled folds, contiguous blocks of a time series, or folds that the user gives.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "base/result.hpp"

namespace prism::training {

/// One fold number, 0 to k − 1, per sample; every fold has members.
using Folds = std::vector<int>;

/// A permutation by the seed, cut in k runs of floor(n / k); the last takes the rest (LS-SVMlab's cut).
Folds shuffled_folds(std::size_t n, int k, std::uint64_t seed);

/// k contiguous blocks that never straddle two runs: each run is cut in its share of the k (at least one). `runs` holds
/// the run of each sample, in order of time. For a time series: neighbours are held out together.
Folds blocked_folds(const std::vector<int>& runs, int k);

/// Numbers of a column (any whole numbers) → 0 to k − 1. Refuses fewer than two folds.
Result<Folds> folds_from(const std::vector<double>& column);

int fold_count(const Folds& folds);
/// Every n-th row, so that no more than `most` are left.
std::vector<Eigen::Index> thinned(Eigen::Index rows, Eigen::Index most);
/// The fold or recording of these rows.
std::vector<int> taken(const std::vector<int>& of_rows, const std::vector<Eigen::Index>& rows);
/// Of `count` rows those that are not among `members`.
std::vector<Eigen::Index> others(const std::vector<Eigen::Index>& members, Eigen::Index count);
/// Indices of each fold's samples.
std::vector<std::vector<Eigen::Index>> fold_members(const Folds& folds);

}  // namespace prism::training
