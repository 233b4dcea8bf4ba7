// SPDX-License-Identifier: MIT
// Prediction by a composite-kernel IR-LSSVM: a Gaussian process whose standard deviation counts what it cannot explain.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "base/result.hpp"
#include "compensation/composite_kernel.hpp"
#include "compensation/lssvm_model.hpp"
#include "compensation/model.hpp"
#include "compensation/posterior_variance.hpp"
#include "compensation/sibling_prior.hpp"

namespace prism::compensation {

/// What training found: the kernel of the bias and what it held apart from it; variances of the normalised target.
struct CompositeVariances {
  CompositeKernel kernel;
  double nuisance = 0;         ///< s4²: what moves with time and not with the inputs
  double nuisance_time_h = 1;  ///< tau, > 0
  double offset = 0;           ///< s5²: from recording to recording; 0 with one recording
  double noise = 1;            ///< s_n² of one training sample, > 0
};

/// Added to the diagonal of H, so that it stays positive definite in double precision.
inline constexpr double kCompositeJitter = 1e-8;

/// What the serving policy and the standard deviation need beyond the kernel (serving.hpp).
struct CompositeTrust {
  double skill = 1;  ///< r: with which each half of the record predicts the other, at most 1
  /// Variance of the nuisance's level (normalised), which no record alone can tell from beta: taken off the model's, >=
  /// 0.
  double level = 0;
  double guard = 1;  ///< model variance beyond this (normalised) is `extrapolating`, > 0
};

struct CompositeParameters {
  CompositeVariances variances;
  double beta = 0;
  Eigen::MatrixXd centres;  ///< d × N, normalised
  Eigen::VectorXd alpha;    ///< N
  // Dense models: what H is made of again. Sparse ones: empty, and `gram` instead.
  Eigen::VectorXd weight;      ///< N, v_k > 0
  Eigen::VectorXd time_h;      ///< N
  std::vector<int> recording;  ///< N
  /// Sparse: [I 0; 0 0] + Ψ Λ⁻¹ Ψᵀ over the training samples, Ψ = [L⁻¹ k; 1], Λ the covariance of all but f.
  Eigen::MatrixXd gram;
  Normalisation normalisation;
  CompositeTrust trust;
  std::optional<SiblingPrior> prior;  ///< all of the above is of the target less its mean
};

/// q(t, t') + s5² over the samples of one recording, 0 between recordings (the part of H that is no function of
/// inputs).
Eigen::MatrixXd nuisance_matrix(const CompositeVariances& variances, const Eigen::VectorXd& time_h,
                                const std::vector<int>& recording);

/// 1 / 1ᵀq⁻¹1 of the nuisance at these times of one recording: the variance of its level. 0 with several recordings,
/// which tell it by s5².
double nuisance_level(const CompositeVariances& variances, const Eigen::VectorXd& time_h,
                      const std::vector<int>& recording);

class CompositeModel final : public Model {
 public:
  /// Factorises once, O(N³/3). Refuses (where: the model's name) shapes that do not agree and a matrix that is not
  /// positive definite. info.kind is "composite", info.spread is there.
  static Result<ModelPtr> make(ModelInfo info, CompositeParameters parameters);

  Prediction predict(std::span<const double> inputs) const override;
  /// One kernel sum.
  double bias_deg_per_h(std::span<const double> inputs) const override;

  const CompositeParameters& parameters() const { return parameters_; }

 private:
  CompositeModel(ModelInfo info, CompositeParameters parameters);
  bool factorise();
  Eigen::VectorXd normalised(std::span<const double> inputs) const;
  double variance(const Eigen::VectorXd& x) const;
  double own_bias_deg_per_h(const Eigen::VectorXd& x) const;  // without what siblings say

  CompositeParameters parameters_;
  CompositeCentres centres_;
  std::optional<PosteriorVariance> posterior_;
};

}  // namespace prism::compensation
