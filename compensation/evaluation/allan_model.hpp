// SPDX-License-Identifier: MIT
// The mixture of five noises that describes an Allan curve, fitted with the covariance of its points.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/evaluation/allan_covariance.hpp"

namespace prism::evaluation {

/// Quasi-likelihood of the strengths of the noises Q, N, B, K, given the overlapping octave points of a rate.
///
/// The cube root of an Allan variance is nearly normal (Wilson and Hilferty 1931), also with few degrees of freedom.
/// Its mean and the covariance of all points follow from the strengths (CurveCovariance), never from the points. A fit
/// solves J' S⁻¹ (u − E u) = 0 with strengths >= 0 by iteration. If the five noises describe the curve worse than
/// chance explains in one of 1 000 records, each variance gets a common relative error in addition: misfit().
///
/// A ramp R is estimated from the mean of the second differences. If it exceeds twice its standard deviation, the other
/// noises are fitted to the points without the mean; else R is 0. Intervals follow from the points without the mean
/// only if the ramp is probable, so that they do not take a random walk for a ramp.
class AllanModel {
 public:
  /// Errors: a curve that is not overlapping or has no point; a deviation of 0 (the rate does not vary).
  static Result<AllanModel> fit(const AllanCurve& curve, const std::string& where);

  /// The strengths from which the intervals of the points follow.
  const NoiseSquares& noise() const { return ramp_is_probable_ ? around_ramp_ : best_; }

  /// The most likely strengths, each 0 or more.
  const NoiseSquares& best() const { return printed_; }

  /// Relative error of the variances, beyond chance, with which the noises describe the curve; 0 if they do.
  double misfit() const { return printed_misfit_; }

  /// Slope of the rate per sample, and its standard deviation for the noises of noise().
  double slope() const { return slope_; }
  double slope_sd() const { return slope_sd_; }

  /// No random walk explains the slope together with the other points: the ratio of the likelihoods with and without a
  /// ramp, each with its most likely K, is as improbable as 4.5 standard deviations. The ramp is probable if the slope
  /// exceeds three standard deviations with the largest K of the interval of one sigma.
  bool ramp_is_certain() const { return ramp_is_certain_; }

  /// Signed root of the quasi-likelihood ratio of `strength` against the best fit: nearly standard normal if `strength`
  /// is the truth; positive if the best fit is larger. `noise`: not R.
  double distance(NoiseType noise, double strength) const;

  /// The strength of `noise`, not R, at which distance() is `distance`; 0 if the distance of 0 is less.
  double strength_at(NoiseType noise, double distance) const;

  /// The most likely strengths if that of `noise`, not R, is given.
  NoiseSquares fit_with(NoiseType noise, double strength) const;

  /// The cube roots near some strengths: mean + F (J (x − strengths) + e), with e normal, independent, of sd 1.
  struct Linear {
    NoiseSquares strengths;
    Eigen::MatrixXd jacobian;  ///< J, one column per noise
    Eigen::VectorXd residual;  ///< F⁻¹ (cube roots − mean)
    Eigen::VectorXd mean;
    Eigen::MatrixXd factor;  ///< F, lower triangle
  };
  Linear linear(const NoiseSquares& strengths) const;

  /// The same if the cube roots of the points were these.
  Linear linear(const NoiseSquares& strengths, const Eigen::VectorXd& cube_roots) const;

  /// Noise if the Allan variance that `point` shows is `variance`: the other points still count.
  NoiseSquares noise_through(const AllanPoint& point, double variance) const;

 private:
  struct State;
  struct Fixed {
    NoiseSquares row;
    double value;
  };
  /// The points, as they are or without the mean of their differences.
  struct Data {
    Eigen::VectorXd cube_roots;
    Eigen::MatrixXd design;               ///< expected variance of each point for a strength of 1
    std::vector<NoiseMatrix> covariance;  ///< of points i <= j, row by row
  };

  explicit AllanModel(const AllanCurve& curve);
  static Data as_measured(const AllanCurve& curve, const CurveCovariance& covariance);
  static Data centred(const AllanCurve& curve, const CurveCovariance& covariance, const Data& as_measured);
  State state(const NoiseSquares& squares) const;
  NoiseSquares start(unsigned free) const;
  NoiseSquares solve(NoiseSquares from, unsigned free, const std::optional<Fixed>& fixed = std::nullopt) const;
  Eigen::MatrixXd jacobian(const State& at) const;
  double cost(const State& at, const NoiseSquares& squares) const;
  void find_best();
  bool find_ramp(const AllanCurve& curve, const Data& as_measured);
  /// −2 ln of the ratio of the likelihoods of no ramp and of a ramp; `slope_variance` is for strengths of 1.
  double ramp_evidence(double typical_walk, const NoiseSquares& slope_variance) const;
  NoiseSquares shrunk() const;

  // For intervals.
  Data data_;
  double misfit_ = 0;
  NoiseSquares best_ = NoiseSquares::Zero(), around_ramp_ = NoiseSquares::Zero();
  bool ramp_is_probable_ = false, ramp_is_certain_ = false;
  double slope_ = 0, slope_sd_ = 0;
  // Estimates.
  double printed_misfit_ = 0;
  NoiseSquares printed_ = NoiseSquares::Zero();
};

}  // namespace prism::evaluation
