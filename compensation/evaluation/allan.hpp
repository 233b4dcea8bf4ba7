// SPDX-License-Identifier: MIT
// Allan deviation of a rate record: overlapping (for evaluation) and non-overlapping (the classic estimate).
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/evaluation/rate_source.hpp"

namespace prism::evaluation {

/// In a series of rates, a missing value is NaN; this value separates two records.
inline constexpr double kAllanBreak = std::numeric_limits<double>::infinity();

enum class AllanEstimator {
  kOverlapping,     ///< clusters from every start: the general-purpose estimate, with narrower confidence intervals
  kNonOverlapping,  ///< adjacent clusters
};

/// Averaging times, in samples per cluster.
enum class AllanGrid {
  kOctave,  ///< 1, 2, 4, 8, …: for evaluation; each point has twice the averaging time of the one before
  kDecade,  ///< 1, 2, 4, 10, 20, 40, 100, …: round numbers for tables
  kDense,   ///< about 15 per decade: for plots only, neighbours are strongly correlated
};

/// One averaging time. tau_s = m · tau0.
struct AllanPoint {
  std::size_t m = 0;
  double tau_s = 0;
  double deviation = 0;      ///< in the rate's unit
  std::size_t terms = 0;     ///< number of squared differences in the sum
  std::size_t clusters = 0;  ///< number of adjacent clusters in the record: the sample size of the point
  /// Overlapping only, of second differences d of the phase with their mean in each record subtracted: Σ d² / (2 m² n).
  double centred_variance = 0;
  double slope_per_sample = 0;  ///< overlapping only: mean of d / m², an estimate of a ramp
  /// Expected variance of quantisation, and of slow noises (B, K), as a ratio to that of a record without lost values.
  double quantisation = 1, slow = 1;
  /// Overlapping only: standard deviation of the quantisation that lost values add, beyond that of white noise of the
  /// same strength, in the unit of `quantisation`: the errors at gaps are few and unequal.
  double gap_deviation = 0;
};

struct AllanCurve {
  AllanEstimator estimator = AllanEstimator::kOverlapping;
  double tau0_s = 0;
  std::size_t values = 0;            ///< number of finite values
  std::size_t holes = 0;             ///< number of gaps: of missing values that follow each other, and of breaks
  std::size_t missing = 0;           ///< number of missing values
  std::size_t runs = 0;              ///< number of segments without a gap
  std::vector<std::size_t> records;  ///< lengths of the records between breaks, with their missing values
  std::vector<AllanPoint> points;
};

/// Cluster sizes of a grid for a record of `values` samples: from 1 to the largest size that fits three times.
std::vector<std::size_t> allan_cluster_sizes(AllanGrid grid, std::size_t values);

/// Allan deviation at the given cluster sizes m (sizes without a pair of clusters are left out):
///   overlapping      σ²(m) = Σ_j (x_{j+2m} − 2 x_{j+m} + x_j)² / (2 m² n),  x_j = Σ_{i<j} y_i, n terms
///   non-overlapping  σ²(m) = Σ_k (ȳ_{k+1} − ȳ_k)² / (2 n)
/// (NIST SP 1065, eqs. 11 and 7). Records between breaks are pooled, without detrending.
///
/// Missing values: a pair of clusters counts if both are complete. If fewer than nine of ten pairs are, a pair
/// counts if each cluster has three quarters of its values; the mean is then of the values that it has, relative to the
/// line through the record, and their difference is scaled to the variance of white noise in complete clusters. If the
/// rate is quantised, the neighbours of a gap count less (AllanPhase).
///
/// Cost: one pass over the phase per m; 9 MB; with missing values 50 MB, and 8 bytes per missing value. Errors: tau0
/// not positive; fewer than three values in every segment without a gap.
Result<AllanCurve> allan_deviation(const RateSource& rate, double tau0_s, std::span<const std::size_t> cluster_sizes,
                                   AllanEstimator estimator, const std::string& where);
/// The same for rates in memory.
Result<AllanCurve> allan_deviation(std::span<const double> rate, double tau0_s,
                                   std::span<const std::size_t> cluster_sizes, AllanEstimator estimator,
                                   const std::string& where);

}  // namespace prism::evaluation
