// SPDX-License-Identifier: MIT
// Long records: products with the inverse covariance of nuisance, offset and noise, O(N) instead of O(N²).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "compensation/composite_model.hpp"

namespace prism::training {

/// Λ = q(t, t') + s5² (same recording) + diag(s_n²/v + 1e-8): an Ornstein-Uhlenbeck process and a constant observed
/// through white noise. A Kalman filter with two states returns its triangular factor row by row.
class NuisanceFilter {
 public:
  /// Samples in order of time within each recording; N each.
  NuisanceFilter(const compensation::CompositeVariances& variances, const Eigen::VectorXd& time_h,
                 const std::vector<int>& recording, const Eigen::VectorXd& weight);

  /// State between one part of the record and the next, for C rows filtered in parallel.
  struct Carry {
    explicit Carry(Eigen::Index rows) : nuisance(Eigen::VectorXd::Zero(rows)), offset(nuisance) {}
    Eigen::VectorXd nuisance, offset;
  };
  /// C rows over the samples from `first` on (C × M) → the same times L⁻ᵀ, with Λ = L Lᵀ; parts must be in order.
  void whiten(Eigen::MatrixXd& values, Eigen::Index first, Carry& carry) const;
  /// Λ⁻¹ y (de Jong 1989: the smoothation error).
  Eigen::VectorXd solve(const Eigen::VectorXd& y) const;

 private:
  // The coefficients of the filter at one sample, independent of the filtered data.
  struct Step {
    double kept = 0;     // fraction of the nuisance kept since the sample before; 0 in a new recording
    bool fresh = false;  // a new recording
    double gain_nuisance = 0, gain_offset = 0;
    double variance = 0;  // of the innovation
  };
  std::vector<Step> steps_;
};

}  // namespace prism::training
