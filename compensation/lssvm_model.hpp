// SPDX-License-Identifier: MIT
// Prediction by a trained LSSVM or IR-LSSVM (paper eqs. 10 and 11), with the standard deviation of its matrices.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "base/result.hpp"
#include "compensation/kernel.hpp"
#include "compensation/model.hpp"

namespace prism::compensation {

/// Parameters of the standard deviation and of the guard; variances in units of the normalised target.
struct LssvmUncertainty {
  double prior_variance = 1;  ///< s_f² of the Gaussian-process reading of the same matrices, > 0
  double sd_scale = 1;        ///< factor on the sd, from held-out residuals compared with the model's own sd, >= 1
  /// A variance above this fraction of prior_variance is `extrapolating`; > 0.
  double guard_fraction = 1;
  /// Sparse models: diag(I/c, 0) + Φ V Φᵀ over the training rows, Φ = [L⁻¹ k; 1], (r + 1) × (r + 1); dense ones: empty.
  Eigen::MatrixXd gram;
};

/// f(x) = Σ alpha_k exp(−‖n(x) − centre_k‖² / (2 sigma2)) + b;  bias = f · target_scale + target_shift.
struct LssvmParameters {
  Eigen::MatrixXd centres;  ///< d × N, normalised, one centre per column
  Eigen::VectorXd alpha;    ///< N
  Eigen::VectorXd weight;   ///< N, the v_k of eq. 14, > 0; all 1 when not re-weighted; empty for sparse models and SVR
  double b = 0;
  double c = 1;       ///< > 0
  double sigma2 = 1;  ///< > 0, in normalised units
  Normalisation normalisation;
  /// A linear part in files of version 0.1: kept, and part of the id, but not used for predictions.
  Eigen::VectorXd linear;
  double linear_b = 0;
  std::optional<LssvmUncertainty> uncertainty;  ///< none: the model has no standard deviation (SVR)
};

class LssvmModel final : public Model {
 public:
  /// Factorises K + diag(1/(c v)) once, O(N³/3), if there is an uncertainty. info.kind: "lssvm", "ir_lssvm",
  /// "sparse_lssvm" or "svr". Errors (`where`: the model's name): inconsistent shapes; a matrix that is not positive
  /// definite.
  static Result<ModelPtr> make(ModelInfo info, LssvmParameters parameters);

  Prediction predict(std::span<const double> inputs) const override;
  /// Cost: one kernel sum; computes no standard deviation.
  double bias_deg_per_h(std::span<const double> inputs) const override;

  const LssvmParameters& parameters() const { return parameters_; }

 private:
  LssvmModel(ModelInfo info, LssvmParameters parameters);
  bool factorise();
  double variance_fraction(std::span<const double> inputs) const;  // Var f / s_f²; requires an uncertainty

  LssvmParameters parameters_;
  KernelCentres centres_;
  std::optional<PosteriorVariance> posterior_;  // in units of s_f²; none without an uncertainty
};

}  // namespace prism::compensation
