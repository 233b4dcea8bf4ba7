// SPDX-License-Identifier: MIT
// Runs the paper's experiment: trains a list of models and evaluates each on all recordings.
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

/// A model to train. Values are those of the options of prismcal train.
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
  std::optional<double> cost_deg_per_h;        ///< F(x): mean absolute error on held-out folds, minimised by tuning
  std::vector<double> weights;                 ///< v_k of the training blocks; empty without weights
  std::vector<SurfacePoint> surface;           ///< points of the grid search
  std::vector<std::pair<std::string, double>> terms;  ///< polynomials: term and coefficient
  std::vector<std::string> trace;                     ///< stepwise: one line per step
  std::vector<std::string> warnings;
  double seconds = 0;
};

/// Must be thread-safe.
using Trainer = std::function<Result<Trained>(const recordings::BlockTable& training, const ModelSpec& spec)>;

struct ExperimentRow {
  ModelSpec spec;
  Trained trained;
  ModelEvaluation fitted;                    ///< on the training recording
  std::vector<ModelEvaluation> evaluations;  ///< one per evaluated recording, in that order
};

/// Training and test data. `evaluated`: the repeat run first, then others.
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

/// Weights and tuning of the model comparison. REML needs no folds, so training uses all of a single profile. Huber's
/// weights have a unique fixed point and need no tuning at three sigma. Results: docs/benchmarks.md.
inline constexpr const char* kUsualWeight = "huber";
inline constexpr const char* kUsualTune = "reml";

/// The models of the paper's tables 2 to 5 with the paper's tuning, then LSSVM with all four tunings, and all weights
/// with contiguous blocks and REML. Without `with_uhfo`, omits models that need U.
std::vector<ModelSpec> paper_models(bool with_uhfo);

/// The models of the comparison (`ladder`): LS, stepwise, LSSVM and IR-LSSVM with Huber's weights; kernels only with
/// all inputs. Takes a quarter of the time.
std::vector<ModelSpec> ladder_models(bool with_uhfo);

/// Trains and evaluates all `specs` on `threads` threads. Returns the rows in the order of `specs`.
/// `progress` is called with (done, total, name of the next model), never concurrently. Stops at the first error, which
/// names the model.
Result<Experiment> run_experiment(ExperimentData data, const std::vector<ModelSpec>& specs, evaluation::Divisor divisor,
                                  const Trainer& train,
                                  const std::function<void(std::size_t, std::size_t, const std::string&)>& progress,
                                  int threads = 1);

struct ExperimentSettings {
  std::string gyro_serial;  ///< serial number that the models are bound to; empty: any gyro
  std::uint64_t seed = 1;   ///< for shuffling the folds
  int folds = 10;
  int reweight_limit = 500;                 ///< maximum number of weighted solves; 1: one re-weighting as in the paper
  const std::atomic<bool>* stop = nullptr;  ///< if set, the current training stops soon with an error (not owned)
};

/// Returns a trainer for run_experiment().
Trainer experiment_trainer(ExperimentSettings settings);

}  // namespace prism::analysis
