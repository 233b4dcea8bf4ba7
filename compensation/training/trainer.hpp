// SPDX-License-Identifier: MIT
// From samples to a model: one call for every method, with all results and diagnostics.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "compensation/composite_model.hpp"
#include "compensation/model.hpp"
#include "compensation/training/held_out.hpp"
#include "compensation/training/polynomial.hpp"
#include "compensation/training/tuning.hpp"

namespace prism::training {

struct Method;
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

enum class NormalisationMethod {
  kZscore,  ///< inputs by mean and sd (divisor N − 1), target by mean and sd (divisor N)
  kAuto,    ///< by column: two values → −1/+1; fewer than √N values → unchanged; else z-score
  kNone,
};

/// The normalised units of the kernels, with the constants for the way back.
struct NormalisedData {
  Eigen::MatrixXd x;  ///< d × N, one sample per column
  Eigen::VectorXd y;  ///< N
  compensation::Normalisation constants;
};

/// Errors: fewer than two samples; numbers that are not finite; a constant input if it must be scaled (`where`: its
/// name). A constant target keeps the scale 1.
Result<NormalisedData> normalise(const TrainingData& data, NormalisationMethod scaling);

/// Normalises new samples with known constants.
Eigen::MatrixXd normalised_inputs(const Eigen::MatrixXd& inputs, const compensation::Normalisation& constants);

/// The user's knowledge about drift in time, for the composite kernel.
enum class Drift {
  kThermal,  ///< what one passage through the temperatures cannot decide is mostly thermal
  kOpen,     ///< the record alone decides
  kNone,     ///< no drift in time
};

/// Missing c and sigma2 are tuned (both or none); the weight's parameter has its usual value (Huber 1.345, myriad 1)
/// if c and sigma2 are given.
struct TrainingSettings : TuningSettings {
  const Method* method = find_method("composite");
  NormalisationMethod scaling = NormalisationMethod::kZscore;
  // Polynomials.
  TermPowers terms;
  StepwiseSettings stepwise;
  // Kernels.
  ReweightSettings reweight{.weight = {.kind = WeightKind::kMyriad}};  ///< for methods with weights only
  Drift drift = Drift::kThermal;
  double epsilon = 0.1;  ///< of SVR, in units of the normalised target
  Tuning tuning = Tuning::kBlocked;
  int folds = 10;
  std::optional<Folds> given_folds;   ///< for kGiven
  std::optional<Folds> second_folds;  ///< set by train(); ir-lssvm: the geometric mean of both choices
  std::uint64_t seed = 1;
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
  std::optional<PolynomialFit> polynomial;  ///< terms by number, as settings.terms lists them
  SampleDiagnostics samples;
  HeldOutErrors held_out;  ///< of the predictions that prismd would use
  /// Share of the record's variance that the population prior explains; below 0: it is misleading.
  std::optional<double> from_siblings;
  int centres = 0;
  std::vector<std::string> notes;  ///< warnings for the user
};

/// Memory and time of a training, estimated before it starts.
struct ResourcePlan {
  double bytes = 0, seconds = 0;  ///< seconds: rough estimate for one core
  bool sparse = false;            ///< a low-rank model instead of one centre per sample
  Eigen::Index max_rank = 0;
  std::string text() const;
};

/// The memory and time of a training of this size. Errors: it needs more memory than the limit.
Result<ResourcePlan> plan_resources(Eigen::Index samples, Eigen::Index inputs, const TrainingSettings& settings);

/// Trains. `info` contains name, features and serial; kind, inputs, domain and id are set here. Errors, in one line:
/// unsuitable data or settings. A stop flag ends tuning early with the best result so far.
Result<TrainedModel> train(const TrainingData& data, compensation::ModelInfo info, const TrainingSettings& settings);

/// train() without its checks and without leaving out gross outliers.
Result<TrainedModel> train_checked(const TrainingData& data, compensation::ModelInfo info,
                                   const TrainingSettings& settings);
Result<TrainedModel> train_with_siblings(const TrainingData& data, compensation::ModelInfo info,
                                         const TrainingSettings& settings);

/// The recording of each sample; 0 if data.runs is empty.
std::vector<int> runs_of(const TrainingData& data);
/// Hours of each sample; rows without times are 100 s apart, as in the paper.
Eigen::VectorXd time_of(const TrainingData& data);
/// The folds of the settings, at most one per sample.
Folds folds_of(const TrainingData& data, const TrainingSettings& settings);

// The training methods. To add one: write its function, and a row in trainer.cpp.

/// Features of a method; each is a group of options of prismcal.
enum MethodUses : unsigned {
  kCubic = 1,         ///< a cubic of one input
  kTerms = 2,         ///< chooses from polynomial terms: --start, --p-enter, --p-remove
  kWeights = 4,       ///< robust weights: --weight
  kTuning = 8,        ///< --c and --sigma2, or --tune
  kTube = 16,         ///< --epsilon
  kOwnSearch = 32,    ///< finds all parameters itself; --c, --sigma2, --tune and --fold-column are errors
  kSiblings = 64,     ///< --prior
  kExactFolds = 128,  ///< `prismcal cv`
  kDrift = 256        ///< --drift
};

/// One checked training; `info` is complete except for its type, id and BetweenRunError.
struct TrainingJob {
  const TrainingData& data;
  compensation::ModelInfo info;
  const TrainingSettings& settings;
  ResourcePlan plan;
  std::vector<int> runs;  ///< recording of each sample
};

struct Method {
  const char* name;
  unsigned uses;  ///< MethodUses
  ResourcePlan (*plan)(double samples, const TrainingSettings& settings);
  Eigen::Index dense_samples, most_centres;  ///< longer records: a sparse model of at most most_centres
  Result<TrainedModel> (*train)(TrainingJob job);

  bool has(MethodUses use) const { return (uses & use) != 0; }
};

Result<TrainedModel> train_polynomial(TrainingJob job);
Result<TrainedModel> train_kernel(TrainingJob job);
Result<TrainedModel> train_composite(TrainingJob job);

/// All methods, the default first.
std::span<const Method> methods();
/// Names of the methods with one of these uses: "lssvm, ir-lssvm" + `last` + "svr".
std::string method_names(unsigned uses, const char* last = ", ");

}  // namespace prism::training
