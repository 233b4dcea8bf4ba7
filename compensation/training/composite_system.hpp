// SPDX-License-Identifier: MIT
// The composite model's training system: the likelihood of one set of kernel parameters, and its predictions.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "compensation/composite_model.hpp"

namespace prism::training {

/// Training samples on normalised inputs and target, in order of time within each recording.
struct CompositeSamples {
  Eigen::MatrixXd x;           ///< d × N
  Eigen::VectorXd y;           ///< N
  Eigen::VectorXd time_h;      ///< N, hours since the recording's start
  std::vector<int> recording;  ///< N, of each sample; samples of a recording are contiguous
  int recordings = 1;
  double warm_up = 0;  ///< s6², fixed (composite_model.hpp)

  CompositeSamples part(const std::vector<Eigen::Index>& rows) const;
};

/// theta: logarithms of s1², l_1² … l_d², s2², s3², s4², tau in hours, s_n²; with several recordings also s5², the
/// variance of their offsets.
Eigen::VectorXd composite_theta(const compensation::CompositeVariances& variances, bool offsets);
compensation::CompositeVariances composite_variances(const Eigen::VectorXd& theta, Eigen::Index inputs);

/// A log-normal prior on the drift's variance s4², which adds weight (ln s4² − centre)²/2 to the objective. In one
/// passage through the temperatures, T and time rise together: without it the drift explains what temperature does.
struct DriftPrior {
  double weight = 0, centre = 0;
};

/// y = beta + f(x) + n(t) + o + e: f ~ GP(0, k), n ~ Ornstein-Uhlenbeck (s4², tau) within a recording, o an offset for
/// each recording (s5²), e ~ N(0, s_n²/v). H is the covariance of all of them, with 1e-8 on its diagonal:
/// beta = 1ᵀH⁻¹y / 1ᵀH⁻¹1, alpha = H⁻¹ (y − beta).
class CompositeSystem {
 public:
  /// `samples` must outlive the system. Returns nullopt if H is not positive definite. O(N³/3), 3 N² numbers.
  static std::optional<CompositeSystem> make(const CompositeSamples& samples, const Eigen::VectorXd& theta,
                                             const Eigen::VectorXd& weight);

  const Eigen::VectorXd& alpha() const { return alpha_; }
  double beta() const { return beta_; }
  /// e at each sample, as far as the model distinguishes it from f, n and o: s_n²/v alpha.
  Eigen::VectorXd residual() const;
  /// −log restricted likelihood up to a constant + 0.005 |theta|² (a weak prior: logarithms of order 10 cost half a
  /// unit) + the prior of the drift. The gradient, if requested, costs another 2 N³/3.
  double objective(Eigen::VectorXd* gradient = nullptr, const DriftPrior& drift = {}) const;
  /// f + beta at other inputs (d × M) and, if requested, their variance without nuisance, offset and noise.
  Eigen::VectorXd predict(const Eigen::MatrixXd& x, Eigen::VectorXd* variance = nullptr) const;

 private:
  CompositeSystem() = default;
  Eigen::VectorXd gradient() const;

  const CompositeSamples* samples_ = nullptr;
  Eigen::VectorXd theta_, weight_;
  compensation::CompositeVariances variances_;
  Eigen::MatrixXd smooth_, nuisance_, factor_;
  Eigen::VectorXd alpha_, nu_;
  double ones_ = 0, beta_ = 0;
};

}  // namespace prism::training
