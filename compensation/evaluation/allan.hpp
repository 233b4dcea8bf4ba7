// SPDX-License-Identifier: MIT
// Allan deviation of a rate record: overlapping (for every evaluation) and non-overlapping (the classic one).
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::evaluation {

enum class AllanEstimator {
  kOverlapping,     ///< every start of a cluster: the general-purpose one, narrower confidence
  kNonOverlapping,  ///< clusters side by side
};

/// Averaging times, in samples per cluster.
enum class AllanGrid {
  kOctave,  ///< 1, 2, 4, 8, …: for judging; each point has seen twice the time of the one before
  kDecade,  ///< 1, 2, 4, 10, 20, 40, 100, …: round numbers for tables
  kDense,   ///< about 15 a decade: for drawing only, neighbours are nearly the same number
};

/// One averaging time. tau_s = m · tau0.
struct AllanPoint {
  std::size_t m = 0;
  double tau_s = 0;
  double deviation = 0;      ///< in the rate's unit
  std::size_t terms = 0;     ///< squared differences in the sum
  std::size_t clusters = 0;  ///< clusters side by side that the record holds: what the point rests on
};

struct AllanCurve {
  AllanEstimator estimator = AllanEstimator::kOverlapping;
  double tau0_s = 0;
  std::size_t values = 0;  ///< finite values used
  std::size_t holes = 0;   ///< values that were not finite
  std::size_t runs = 0;    ///< stretches without a hole; a cluster pair never spans two of them
  std::vector<AllanPoint> points;
};

/// Cluster sizes of a grid for a record of `values` samples: 1 up to the size that fits three clusters.
std::vector<std::size_t> allan_cluster_sizes(AllanGrid grid, std::size_t values);

/// Allan deviation at the given cluster sizes m (those with no pair of clusters are left out):
///   overlapping      σ²(m) = Σ_j (x_{j+2m} − 2 x_{j+m} + x_j)² / (2 m² n),  x_j = Σ_{i<j} y_i, n terms
///   non-overlapping  σ²(m) = Σ_k (ȳ_{k+1} − ȳ_k)² / (2 n)
/// (NIST SP 1065, eqs. 11 and 7). A value that is not finite is a hole: the terms of the runs between holes are pooled,
/// nothing is interpolated, nothing is detrended. Cost: one pass over the record per m; 8 bytes a value.
/// Refused: tau0 not positive; fewer than three values in every run.
Result<AllanCurve> allan_deviation(std::span<const double> rate, double tau0_s,
                                   std::span<const std::size_t> cluster_sizes, AllanEstimator estimator,
                                   const std::string& where);

}  // namespace prism::evaluation
