// SPDX-License-Identifier: MIT
// The paper's experiment as a list of models to train, and what came of each on every recording.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/prismcal/analysis/model_evaluation.hpp"

namespace prism::analysis {

/// A model to train. Values as in the options of prismcal train.
struct ModelSpec {
  std::string method;               ///< "ls", "stepwise", "lssvm", "ir-lssvm"
  std::vector<std::string> inputs;  ///< "T", "dTdt", "U"
  std::string weight;               ///< "huber", "hampel", "logistic", "myriad"; empty: none
  std::string tune;                 ///< "shuffled" (ten-fold), "loo", "blocked", "reml"; empty: nothing to tune

  std::string key() const;          ///< unique in an experiment: "ir-lssvm T,dTdt,U myriad shuffled"
  std::string inputs_text() const;  ///< "T, dT/dt, U"
};

struct SurfacePoint {
  double c = 0, sigma2 = 0, cost_deg_per_h = 0;
};

/// A model, and the training results that the model does not contain.
struct Trained {
  compensation::ModelPtr model;
  std::optional<double> c, sigma2, parameter;  ///< of kernel models; `parameter` is Huber's beta or myriad's delta
  std::optional<double> cost_deg_per_h;        ///< F(x): the held-out mean absolute error it was tuned by
  std::vector<double> weights;                 ///< v_k of the training blocks, where the method weighs
  std::vector<SurfacePoint> surface;           ///< the grid search
  std::vector<std::pair<std::string, double>> terms;  ///< of polynomials: term and coefficient
  std::vector<std::string> trace;                     ///< stepwise: one line a step
  std::vector<std::string> warnings;
  double seconds = 0;
};

/// Called from several threads at a time.
using Trainer = std::function<Result<Trained>(const recordings::BlockTable& training, const ModelSpec& spec)>;

struct ExperimentRow {
  ModelSpec spec;
  Trained trained;
  ModelEvaluation fitted;               ///< on the training recording itself
  std::vector<ModelEvaluation> judged;  ///< one per evaluated recording, in their order
};

/// Training data and test data: the repeat of the profile first, then others.
struct ExperimentData {
  recordings::BlockTable training;
  std::vector<recordings::BlockTable> evaluated;
  CorrectionSettings correction = {};
};

struct Experiment {
  ExperimentData data;
  evaluation::Divisor divisor = evaluation::Divisor::kNMinus1;
  std::vector<ExperimentRow> rows;

  const ExperimentRow* find(const std::string& key) const;
};

/// The ladder's own choice. REML needs no folds, so that a single profile can be learned whole; Huber's weights have
/// one fixed point only and at three sigma need no tuning. Results: docs/benchmarks.md.
inline constexpr const char* kUsualWeight = "huber";
inline constexpr const char* kUsualTune = "reml";

/// The models of the paper's tables 2 to 5 with the paper's tuning, then those that the paper lacks: LSSVM by all four
/// tunings, and all weights by contiguous blocks and by REML. `with_uhfo` false leaves out all that need U.
std::vector<ModelSpec> paper_models(bool with_uhfo);

/// One of each kind with all inputs, in a quarter of the time: LS, stepwise, LSSVM and Huber's IR-LSSVM.
std::vector<ModelSpec> ladder_models(bool with_uhfo);

/// Trains and evaluates all `specs` on `threads` threads. Returns the rows in the order of `specs`.
/// `progress` is called with (done, total, name of the next model), never concurrently. Stops at the first error, which
/// names the model.
Result<Experiment> run_experiment(ExperimentData data, const std::vector<ModelSpec>& specs, evaluation::Divisor divisor,
                                  const Trainer& train,
                                  const std::function<void(std::size_t, std::size_t, const std::string&)>& progress,
                                  int threads = 1);

struct ExperimentSettings {
  std::string gyro_serial;  ///< the models are bound to it; empty: any gyro
  std::uint64_t seed = 1;   ///< of the shuffled folds
  int folds = 10;
  int reweight_limit = 500;                 ///< weighted solves at most; 1: the paper's single re-weighting
  const std::atomic<bool>* stop = nullptr;  ///< set: the training under way ends soon, and is refused (not owned)
};

/// Ready to hand to run_experiment().
Trainer experiment_trainer(ExperimentSettings settings);

}  // namespace prism::analysis
