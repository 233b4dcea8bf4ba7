// SPDX-License-Identifier: MIT
// Cross-validation folds: shuffled, contiguous blocks of a time series, or given by the user.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "base/result.hpp"

namespace prism::training {

/// One fold number per sample, 0 to k − 1; every fold has samples.
using Folds = std::vector<int>;

/// A permutation by the seed, divided into k parts of floor(n / k); the last contains the rest (as in LS-SVMlab).
Folds shuffled_folds(std::size_t n, int k, std::uint64_t seed);

/// k contiguous blocks that never span two runs: each run has its share of the k (at least one). `runs` is the run of
/// each sample, in order of time. For time series: neighbours are held out together.
Folds blocked_folds(const std::vector<int>& runs, int k);

/// Fold numbers of a column (any integers) → 0 to k − 1. Errors: fewer than two folds.
Result<Folds> folds_from(const std::vector<double>& column);

/// Numbers of folds or recordings without gaps, in the same order.
std::vector<int> numbered(const std::vector<int>& numbers);

int fold_count(const Folds& folds);
/// Every n-th row, so that at most `most` remain.
std::vector<Eigen::Index> thinned(Eigen::Index rows, Eigen::Index most);
/// The folds or recordings of these rows.
std::vector<int> taken(const std::vector<int>& of_rows, const std::vector<Eigen::Index>& rows);
/// The rows of 0 to `count` − 1 that are not in `members`.
std::vector<Eigen::Index> others(const std::vector<Eigen::Index>& members, Eigen::Index count);
/// Indices of each fold's samples.
std::vector<std::vector<Eigen::Index>> fold_members(const Folds& folds);

}  // namespace prism::training
