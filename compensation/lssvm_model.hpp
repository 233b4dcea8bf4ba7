// SPDX-License-Identifier: MIT
// Prediction by a trained LSSVM or IR-LSSVM (paper eqs. 10 and 11), with the standard deviation its matrices give.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "base/result.hpp"
#include "compensation/kernel.hpp"
#include "compensation/model.hpp"
#include "compensation/posterior_variance.hpp"

namespace prism::compensation {

/// Shift and scale between engineering units and the units the kernel works in: n = (x − shift) / scale.
struct Normalisation {
  Eigen::VectorXd input_shift, input_scale;  ///< d each; scale > 0
  double target_shift = 0, target_scale = 1;
};

/// What the standard deviation and the guard need beyond the centres; variances in units of the normalised target.
struct LssvmUncertainty {
  double prior_variance = 1;  ///< s_f² of the Gaussian-process reading of the same matrices, > 0
  double sd_scale = 1;  ///< the sd is multiplied by this: what held-out residuals say about the model's own sd, >= 1
  /// A variance above this fraction of prior_variance is `extrapolating`; > 0.
  double guard_fraction = 1;
  /// Sparse models: diag(I/c, 0) + Φ V Φᵀ over the training rows, Φ = [L⁻¹ k; 1], (r + 1) × (r + 1); dense ones: empty.
  Eigen::MatrixXd gram;
};

/// f(x) = Σ alpha_k exp(−‖n(x) − centre_k‖² / (2 sigma2)) + b;  bias = f · target_scale + target_shift.
struct LssvmParameters {
  Eigen::MatrixXd centres;  ///< d × N, normalised, one centre a column
  Eigen::VectorXd alpha;    ///< N
  Eigen::VectorXd weight;   ///< N, the v_k of eq. 14, > 0; all 1 when not re-weighted; empty for sparse models and SVR
  double b = 0;
  double c = 1;       ///< > 0
  double sigma2 = 1;  ///< > 0, in normalised units
  Normalisation normalisation;
  /// A linear part, as files of version 0.1 have it: kept, and part of the id, but nothing is served from it any more.
  Eigen::VectorXd linear;
  double linear_b = 0;
  std::optional<LssvmUncertainty> uncertainty;  ///< none: the model has no standard deviation (SVR)
};

class LssvmModel final : public Model {
 public:
  /// Factorises K + diag(1/(c v)) once, O(N³/3), if there is an uncertainty. Refuses (where: the model's name) shapes
  /// that do not agree and a matrix that is not positive definite. info.kind: "lssvm", "ir_lssvm", "sparse_lssvm" or
  /// "svr".
  static Result<ModelPtr> make(ModelInfo info, LssvmParameters parameters);

  Prediction predict(std::span<const double> inputs) const override;
  /// One kernel sum, no standard deviation.
  double bias_deg_per_h(std::span<const double> inputs) const override;

  const LssvmParameters& parameters() const { return parameters_; }

 private:
  LssvmModel(ModelInfo info, LssvmParameters parameters);
  bool factorise();
  std::vector<double> normalised(std::span<const double> inputs) const;
  double variance_fraction(std::span<const double> point) const;  // Var f / s_f²; needs an uncertainty

  LssvmParameters parameters_;
  KernelCentres centres_;
  std::optional<PosteriorVariance> posterior_;  // in units of s_f²; none without an uncertainty
};

}  // namespace prism::compensation
