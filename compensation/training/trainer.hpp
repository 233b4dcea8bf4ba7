// SPDX-License-Identifier: MIT
// From samples to a model: one call for every method, with all results and diagnostics.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compensation/composite_model.hpp"
#include "compensation/model.hpp"
#include "compensation/training/between_run_error.hpp"
#include "compensation/training/least_squares.hpp"
#include "compensation/training/normalise.hpp"
#include "compensation/training/resource_plan.hpp"
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

/// The terms of a polynomial: powers of the inputs, one list per term (the intercept is implicit).
using TermPowers = std::vector<std::vector<int>>;
TermPowers cubic_terms();               ///< x, x², x³ of the only input (eq. 21)
TermPowers plain_terms(std::size_t d);  ///< every input itself
/// Inputs, squares and products of two (eqs. 22 and 24): T, T², dT/dt, (dT/dt)², …
TermPowers second_order_terms(std::size_t d);
/// "T", "T^2", "T*dTdt".
std::string term_name(const std::vector<int>& powers, const std::vector<std::string>& names);

/// The user's knowledge about drift in time, for the composite kernel.
enum class Drift {
  kThermal,  ///< what one passage through the temperatures cannot decide is mostly thermal
  kOpen,     ///< the record alone decides
  kNone,     ///< no drift in time
};

struct TrainingSettings {
  const Method* method = find_method("ir-lssvm");
  NormalisationMethod scaling = NormalisationMethod::kZscore;
  // Polynomials.
  TermPowers terms;
  StepwiseSettings stepwise;
  // Kernels. Missing values are tuned: c and sigma2 both or none; the weight's parameter has its usual value (Huber
  // 1.345, myriad 1) if c and sigma2 are given.
  ReweightSettings reweight;  ///< for methods with weights only
  std::optional<double> c, sigma2, parameter;
  Drift drift = Drift::kThermal;
  double epsilon = 0.1;  ///< of SVR, in units of the normalised target
  Tuning tuning = Tuning::kBlocked;
  int folds = 10;
  std::optional<Folds> given_folds;   ///< for kGiven
  std::optional<Folds> second_folds;  ///< set by train(); ir-lssvm: the geometric mean of both choices
  std::uint64_t seed = 1;
  int threads = 2;
  std::vector<compensation::ModelPtr> siblings;  ///< composite: models of gyros of the same type, none or at least 2
  std::optional<compensation::PopulationPrior> prior;  ///< the population prior; set by train()
  double memory_limit_bytes = 1e9;                     ///< larger trainings are rejected before they start
};

/// One row per training sample.
struct SampleDiagnostics {
  Eigen::VectorXd alpha;          ///< 0 if the sample is not a centre; empty for polynomials
  Eigen::VectorXd weight;         ///< v_k; 1 for methods without weights
  Eigen::VectorXd fitted;         ///< in the target's units
  Eigen::VectorXd leave_one_out;  ///< y minus the prediction without this sample (weights frozen); target's units
};

struct TrainedModel {
  compensation::ModelPtr model;
  double c = 0, sigma2 = 0, parameter = 0;  ///< kernels only
  std::optional<TuningResult> tuning;       ///< if parameters were tuned
  std::optional<ReweightReport> reweight;
  std::optional<StepwiseResult> stepwise;  ///< terms by number, as settings.terms lists them
  std::optional<LinearFit> linear;         ///< polynomials
  double condition = 0;                    ///< of the design matrix (polynomials)
  SampleDiagnostics samples;
  HeldOutErrors held_out;  ///< of the predictions that prismd would use
  std::optional<double>
      from_siblings;  ///< share of the record's variance that the population prior explains; below 0: it is misleading
  int centres = 0;
  std::vector<std::string> notes;  ///< warnings for the user
};

/// The memory and time of a training of this size, before it starts.
Result<ResourcePlan> plan_resources(Eigen::Index samples, Eigen::Index inputs, const TrainingSettings& settings);

/// Trains. `info` contains name, features and serial; kind, inputs, domain and id are set here. Errors, in one line:
/// unsuitable data or settings. A stop flag ends tuning early with the best result so far.
Result<TrainedModel> train(const TrainingData& data, compensation::ModelInfo info, const TrainingSettings& settings,
                           const TuningProgress& progress = {}, const std::atomic<bool>* stop = nullptr);

Result<TrainedModel> train_with_siblings(const TrainingData& data, compensation::ModelInfo info,
                                         const TrainingSettings& settings, const TuningProgress& progress,
                                         const std::atomic<bool>* stop);
/// The recording of each sample; 0 if data.runs is empty.
std::vector<int> runs_of(const TrainingData& data);
/// Hours of each sample; rows without times are 100 s apart, as in the paper.
Eigen::VectorXd time_of(const TrainingData& data);

}  // namespace prism::training
