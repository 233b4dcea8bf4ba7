// SPDX-License-Identifier: MIT
// Covariance of the points of an Allan curve, computed for a mixture of the five noises of IEEE Std 952.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>

#include "compensation/evaluation/allan.hpp"

namespace prism::evaluation {

/// Noises of a rate in gyro practice, in the order of IEEE Std 952; in parentheses: names in the frequency standards.
enum class NoiseType {
  kQuantisation,     ///< Q (white phase noise): slope −1
  kAngleRandomWalk,  ///< N (white frequency noise): slope −1/2
  kBiasInstability,  ///< B (flicker frequency noise): slope 0
  kRateRandomWalk,   ///< K (random walk of frequency): slope +1/2
  kRateRamp,         ///< R (frequency drift, not random): slope +1
};

inline constexpr std::size_t kNoiseTypes = 5;

const char* noise_type_text(NoiseType type);

/// Strength of each noise, in the order of NoiseType: the Allan variance that it adds at cluster size m is
///   Q: 3 q / m²,  N: s / m,  B: b,  K: k m / 3,  R: r m² / 2      (squares of the rate's unit; time in samples).
using NoiseSquares = Eigen::Matrix<double, kNoiseTypes, 1>;

/// Allan variance at cluster size m for a strength of 1.
NoiseSquares unit_variances(double m);

/// θ' G θ is a covariance for the strengths θ.
using NoiseMatrix = Eigen::Matrix<double, kNoiseTypes, kNoiseTypes>;

/// The strengths that a point of a record with missing values shows: M θ. The angle errors at a gap do not cancel, so
/// that part of Q looks like N. Two points: for the covariance of both.
NoiseMatrix shown_noise(const AllanPoint& point);
NoiseMatrix shown_noise(const AllanPoint& a, const AllanPoint& b);

/// Expected Allan variance of a point for a strength of 1, with the effect of missing values.
NoiseSquares expected_variances(const AllanPoint& point);

/// The variance of a record without missing values, as a share of what the point shows: 1 if no value is missing.
double own_share(const AllanPoint& point, const NoiseSquares& noise);

/// A point is determined if missing values add at most two fifths of its variance. Above, the noises that are fitted to
/// the same points decide too much: with half, the intervals held the truth in 50 % of 225 records.
inline constexpr double kDeterminedShare = 0.6;

/// Covariance of the overlapping Allan variances at cluster sizes m1 and m2 of one record of `values` rates without a
/// gap. Sums the squared covariances of all pairs of second differences of the phase, from the generalised
/// autocovariance of the phase (Greenhall and Riley 2003, "Uncertainty of stability variances based on finite
/// differences"): Q: δ(t), N: −|t|/2, B: t² ln|t| / (4 ln 2), K: |t|³/12. A ramp adds a constant to each difference.
/// Requires 2 m1, 2 m2 <= values.
NoiseMatrix overlapping_covariance(std::size_t values, std::size_t m1, std::size_t m2);

/// The part of overlapping_covariance() that is lost if the mean of the second differences is subtracted first, which
/// removes a ramp. Negligible, and 0, for clusters below 1/512 of the record.
NoiseMatrix centring_covariance(std::size_t values, std::size_t m1, std::size_t m2);

/// 8 / skewness² of the overlapping Allan variance of one record without a gap, at most eight clusters long: a
/// chi-square number with these degrees of freedom has the same skewness (Liu, Tang and Zhang 2009). With few clusters
/// that is less than 2 E² / Var, because one term of the sum dominates. A ramp in `noise` does not count.
double skewness_degrees_of_freedom(std::size_t values, std::size_t m, const NoiseSquares& noise);

/// Variance of the Allan variance of adjacent clusters.
NoiseMatrix adjacent_variance(std::size_t values, std::size_t m);

/// Number of terms of a record without a gap.
std::size_t allan_terms(AllanEstimator estimator, std::size_t values, std::size_t m);

/// Covariances of the points of a curve. The records between breaks are independent; values that are missing reduce the
/// number of terms, and the variance grows in proportion; shown_noise() has the noise that they add.
class CurveCovariance {
 public:
  /// `curve` must outlive the object.
  explicit CurveCovariance(const AllanCurve& curve);

  /// Covariance of the variances of two points; for adjacent clusters only i == j.
  NoiseMatrix operator()(std::size_t i, std::size_t j) const;

  /// The same for AllanPoint::centred_variance; overlapping only.
  NoiseMatrix centred(std::size_t i, std::size_t j) const;

 private:
  template <class Covariance>
  NoiseMatrix pooled(std::size_t i, std::size_t j, Covariance&& of_record) const;

  const AllanCurve& curve_;
  std::map<std::size_t, std::size_t> records_;  ///< length → number of records
};

}  // namespace prism::evaluation
