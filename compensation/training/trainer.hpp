// SPDX-License-Identifier: MIT
// From samples to a model: one call for every method, with all that a person may want to know about how it went.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compensation/model.hpp"
#include "compensation/sibling_prior.hpp"
#include "compensation/training/normalise.hpp"
#include "compensation/training/resource_plan.hpp"
#include "compensation/training/stepwise.hpp"
#include "compensation/training/tuning.hpp"

namespace prism::training {

struct Method;  // methods.hpp
/// Returns nullptr if no method has this name.
const Method* find_method(std::string_view name);

/// Samples in engineering units.
struct TrainingData {
  std::vector<std::string> names;  ///< of the d inputs
  Eigen::MatrixXd inputs;          ///< d × N
  Eigen::VectorXd target;          ///< N
  std::vector<int> runs;           ///< recording of each sample, in order of time; empty: one run
  Eigen::VectorXd time_s;  ///< N, since its recording began; empty: evenly spaced (the composite kernel's nuisance)
};

/// What a polynomial is made of: powers of the inputs, one list per term (no intercept, it is always there).
using TermPowers = std::vector<std::vector<int>>;
TermPowers cubic_terms();               ///< x, x², x³ of the only input (eq. 21)
TermPowers plain_terms(std::size_t d);  ///< every input as it is
/// Inputs, squares and products of two (eqs. 22 and 24): T, T², dT/dt, (dT/dt)², …
TermPowers second_order_terms(std::size_t d);
/// "T", "T^2", "T*dTdt".
std::string term_name(const std::vector<int>& powers, const std::vector<std::string>& names);

struct TrainingSettings {
  const Method* method = find_method("ir-lssvm");
  Scaling scaling = Scaling::kZscore;
  // Polynomials.
  TermPowers terms;
  StepwiseSettings stepwise;
  // Kernels. What is not given is tuned: c and sigma2 both or none; the weight's parameter falls back on its usual
  // value (Huber 1.345, myriad 1) where c and sigma2 are given.
  ReweightSettings reweight;  ///< used by methods with weights alone
  std::optional<double> c, sigma2, parameter;
  double epsilon = 0.1;  ///< of SVR, in units of the normalised target
  Tuning tuning = Tuning::kBlocked;
  int folds = 10;
  std::optional<Folds> given_folds;  ///< for kGiven
  std::uint64_t seed = 1;
  int threads = 2;
  std::vector<compensation::ModelPtr> siblings;     ///< composite: models of gyros of the same type, none or at least 2
  std::optional<compensation::SiblingPrior> prior;  ///< what they say; set by train()
  double memory_limit_bytes = 1e9;                  ///< what does not fit is refused before it begins
};

/// One row per training sample.
struct SampleDiagnostics {
  Eigen::VectorXd alpha;          ///< 0 where the sample is no centre; empty for polynomials
  Eigen::VectorXd weight;         ///< v_k; 1 for methods without weights
  Eigen::VectorXd fitted;         ///< in the target's units
  Eigen::VectorXd leave_one_out;  ///< y minus the prediction without this sample (weights frozen); target's units
};

struct TrainedModel {
  compensation::ModelPtr model;
  double c = 0, sigma2 = 0, parameter = 0;  ///< kernels only
  std::optional<TuningResult> tuning;       ///< where something was tuned
  std::optional<ReweightReport> reweight;
  std::optional<StepwiseResult> stepwise;  ///< terms by number, as settings.terms lists them
  std::optional<LinearFit> linear;         ///< polynomials
  double condition = 0;                    ///< of the design matrix (polynomials)
  SampleDiagnostics samples;
  std::optional<double> from_siblings;  ///< share of the record's variance that they explain; below 0: they mislead
  int centres = 0;
  int refinement_steps = 0;
  std::vector<std::string> notes;  ///< warnings for people
};

/// What a training of this size takes, before it is begun.
Result<ResourcePlan> plan_resources(Eigen::Index samples, Eigen::Index inputs, const TrainingSettings& settings);

/// Trains. `info` brings name, features and serial; kind, inputs, domain and id are set here. Refuses data and settings
/// that cannot work, in one line. A stop flag ends tuning early with the best so far.
Result<TrainedModel> train(const TrainingData& data, compensation::ModelInfo info, const TrainingSettings& settings,
                           const TuningProgress& progress = {}, const std::atomic<bool>* stop = nullptr);

Result<TrainedModel> train_with_siblings(const TrainingData& data, compensation::ModelInfo info,
                                         const TrainingSettings& settings, const TuningProgress& progress,
                                         const std::atomic<bool>* stop);
/// Hours of each sample; without times the rows are the paper's 100 s apart.
Eigen::VectorXd time_of(const TrainingData& data);

}  // namespace prism::training
