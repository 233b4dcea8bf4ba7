// SPDX-License-Identifier: MIT
// Prediction by a composite-kernel IR-LSSVM: a Gaussian process whose sd includes the unexplained (nuisance) drift.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/result.hpp"
#include "compensation/kernel.hpp"
#include "compensation/lssvm_model.hpp"
#include "compensation/model.hpp"

namespace prism::compensation {

// The population prior: the scaled mean of the models of other gyros of the same type, for a gyro with a short record.

/// m(x) = scale · mean over the gyros of (f_s(x) − level_s), each evaluated at the nearest point of its own box.
struct PopulationPrior {
  double scale = 1;              ///< thermal drift of this gyro over that of the others, > 0
  std::vector<ModelPtr> models;  ///< at least two, with the inputs and features of the model that uses them
  std::vector<double> levels;    ///< deg/h, mean of each over its training record: subtracted, because levels differ by
                                 ///< more than the drift

  struct PriorPrediction {
    double mean_deg_per_h = 0;   ///< m(x)
    double variance = 0;         ///< of a gyro about m(x): variance of the models plus that of their mean, (deg/h)²
    bool extrapolating = false;  ///< true if any of the models is outside its training range
  };
  PriorPrediction at(std::span<const double> inputs) const;
};

/// The kernel of the bias, and the nuisance terms that training separated from it; variances of the normalised target.
struct CompositeVariances {
  CompositeKernel kernel;
  double nuisance = 0;         ///< s4²: drift in time that the inputs do not explain
  double nuisance_time_h = 1;  ///< tau, > 0
  double offset = 0;           ///< s5²: from recording to recording; 0 with one recording
  double noise = 1;            ///< s_n² of one training sample, > 0
  double warm_up = 0;          ///< s_6² of a drift exp(−t/1 h) after switch-on, the same in all recordings; 0: none
};

/// Added to the diagonal of H, so that it stays positive definite in double precision.
inline constexpr double kCompositeJitter = 1e-8;

/// Parameters of the extrapolation policy (extrapolation.hpp) and of the standard deviation beyond the kernel.
struct UncertaintySettings {
  double skill = 1;  ///< r: cross-prediction skill score (1 − MSE / variance) of the halves of the record, at most 1
  /// Variance of the nuisance's level (normalised), >= 0. One record cannot distinguish it from beta, so it is
  /// subtracted from the model's variance.
  double level = 0;
  double guard = 1;    ///< a larger model variance (normalised) sets `extrapolating`, > 0
  double overlap = 1;  ///< share of the worse half that the other half knows, 0 to 1
  /// Share of each input in the mean squared gradient of the bias; sum 1. Empty in models of version 0.2.
  std::vector<double> relevance;
};

struct CompositeParameters {
  CompositeVariances variances;
  double beta = 0;
  Eigen::MatrixXd centres;  ///< d × N, normalised
  Eigen::VectorXd alpha;    ///< N
  // Dense models: the data from which H is rebuilt. Empty for sparse models, which have `gram`.
  Eigen::VectorXd weight;      ///< N, v_k > 0
  Eigen::VectorXd time_h;      ///< N
  std::vector<int> recording;  ///< N
  /// Sparse: [I 0; 0 0] + Ψ Λ⁻¹ Ψᵀ over the training samples, Ψ = [L⁻¹ k; 1], Λ the covariance of all but f.
  Eigen::MatrixXd gram;
  Normalisation normalisation;
  UncertaintySettings trust;
  std::optional<PopulationPrior> prior;  ///< if set, all parameters above are of the target minus the prior's mean
};

/// q(t, t') + s5² over the samples of one recording, 0 between recordings (the part of H that does not depend on the
/// inputs).
Eigen::MatrixXd nuisance_matrix(const CompositeVariances& variances, const Eigen::VectorXd& time_h,
                                const std::vector<int>& recording);

/// h += s6² w wᵀ, w = exp(−t/1 h), over all samples.
void add_warm_up(const CompositeVariances& variances, const Eigen::VectorXd& time_h, Eigen::MatrixXd& h);

/// 1 / 1ᵀq⁻¹1 of the nuisance at these times of one recording: the variance of its level. 0 with several recordings,
/// because s5² then includes it.
double nuisance_level(const CompositeVariances& variances, const Eigen::VectorXd& time_h,
                      const std::vector<int>& recording);

class CompositeModel final : public Model {
 public:
  /// Factorises once, O(N³/3). Requires info.kind "composite" and info.spread. Errors (`where`: the model's name):
  /// inconsistent shapes; a matrix that is not positive definite.
  static Result<ModelPtr> make(ModelInfo info, CompositeParameters parameters);

  Prediction predict(std::span<const double> inputs) const override;
  /// Cost: one kernel sum.
  double bias_deg_per_h(std::span<const double> inputs) const override;

  const CompositeParameters& parameters() const { return parameters_; }

 private:
  CompositeModel(ModelInfo info, CompositeParameters parameters);
  bool factorise();
  double variance(const Eigen::VectorXd& x) const;
  double own_bias_deg_per_h(const Eigen::VectorXd& x) const;  // without the population prior
  std::vector<double> edge_of(std::span<const double> inputs) const;

  CompositeParameters parameters_;
  CompositeCentres centres_;
  std::optional<PosteriorVariance> posterior_;
};

}  // namespace prism::compensation
