// SPDX-License-Identifier: MIT
// The composite kernel: the likelihood of one set of its parameters, the search for them by REML, alternating with
// robust weights, and long records over a few centres.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "compensation/composite_model.hpp"
#include "compensation/training/held_out.hpp"
#include "compensation/training/robust.hpp"
#include "compensation/training/trainer.hpp"
#include "compensation/training/tuning.hpp"

namespace prism::training {

/// Training samples on normalised inputs and target, in order of time within each recording.
struct CompositeSamples {
  Eigen::MatrixXd x;           ///< d × N
  Eigen::VectorXd y;           ///< N
  Eigen::VectorXd time_h;      ///< N, hours since the recording's start
  std::vector<int> recording;  ///< N, of each sample; samples of a recording are contiguous
  int recordings = 1;
  double warm_up = 0;  ///< s6², fixed (composite_model.hpp)

  CompositeSamples part(const Rows& rows) const;
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

DriftPrior drift_prior(Drift drift);

/// One recording whose temperature (the first input, if none is named T) has a path hardly longer than its range.
bool one_passage(const TrainingData& data);

/// First weights: as good as none for rows far from their neighbours, so that no drift in time is found that follows
/// them.
Eigen::VectorXd first_weights(const TrainingData& data, const TrainingSettings& settings);

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

/// Minimum weight: with a weight of zero H would not be finite.
inline constexpr double kMinCompositeWeight = 1e-7;

/// The weights take rows with a smaller one for outliers.
inline constexpr double kBelievedWeight = 0.3;
/// Standard deviation of y without the rows that the weights take for outliers.
double believed_sd(const Eigen::VectorXd& y, const Eigen::VectorXd& weight);

struct CompositeFit {
  Eigen::VectorXd theta;
  Eigen::VectorXd weight;  ///< N; the first ones after the search
  double objective = 0;    ///< over the samples of the last search
};

/// Several starts on every n-th sample (about 300), then the best is refined on about 500 and 1000; weights are
/// iterated before each refinement, from `first` (N). Errors: no start has a finite objective.
/// `tuning`: for progress, with the objective as cost, and the stop flag.
Result<CompositeFit> search_composite(const CompositeSamples& samples, const ReweightSettings& settings,
                                      const DriftPrior& drift, const TuningSettings& tuning,
                                      const Eigen::VectorXd& first);

/// The best of several starts, unweighted, on all of the samples: a few hundred. An infinite objective: none is finite.
CompositeFit likely_theta(const CompositeSamples& samples, const DriftPrior& drift, const TuningSettings& tuning);

// Long records: the composite kernel over a few centres, with a filter for the nuisance; O(N r²) instead of O(N³).

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

/// Pivots of the kernel over these points (d × N, normalised), until the rest is at most `tolerance`.
LowRank composite_pivots(const compensation::CompositeKernel& kernel, const Eigen::MatrixXd& points, double tolerance,
                         Eigen::Index max_rank);

/// A model's parameters for given theta, without normalisation, trust and prior.
struct CompositeSolution {
  compensation::CompositeParameters parameters;
  Rows centres;                    ///< indices of the samples
  Eigen::VectorXd weight, fitted;  ///< N; fitted: f + beta
  ReweightReport reweight;
};

/// Re-weights by the noise residuals, from `weight`, until the weights converge; one centre per sample. Returns nullopt
/// if a system is not positive definite.
std::optional<CompositeSolution> solve_composite(const CompositeSamples& samples, const Eigen::VectorXd& theta,
                                                 const Eigen::VectorXd& weight, const ReweightSettings& settings);

/// The same from weights of 1, over a few centres: f(x) ≈ wᵀ φ(x), φ = L⁻¹ k(x), L Lᵀ = K over the centres (Nyström;
/// Williams and Seeger 2001), w ~ N(0, 1). Centres by pivoted Cholesky among at most 4000 samples, until the rest is
/// far below the noise or there are `max_rank`.
std::optional<CompositeSolution> solve_sparse_composite(const CompositeSamples& samples, const Eigen::VectorXd& theta,
                                                        ReweightSettings settings, Eigen::Index max_rank);

}  // namespace prism::training
