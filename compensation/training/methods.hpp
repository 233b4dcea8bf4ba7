// SPDX-License-Identifier: MIT
// The training methods, one row each: name, options, and functions that plan, train and report.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "compensation/training/trainer.hpp"

namespace prism::training {

// The result of a training as JSON and as readable lines: the part of each method.

struct MethodSummary {
  nlohmann::ordered_json json;
  std::string text;  ///< lines of detail_line()
};

/// "  skill          0.79: …": a value with its unit and meaning, or the next value of the same name (empty).
std::string detail_line(const std::string& name, const std::string& text);
/// "deg/h", or "units of the target" for a model of a table.
std::string target_unit(const TrainedModel& trained);
/// `value` with `digits` significant digits, and without an exponent from 1e-7 to 1e9: 170, 0.0004.
std::string plain_number(double value, int digits);

/// "blocked folds", "reml", …
const char* tuning_text(Tuning tuning);

/// The number, or null if it is not finite.
inline nlohmann::ordered_json finite_json(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

// To add a method: write its trainer with a row of type Method at its end, and list the row in methods.cpp.

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

/// The folds of the settings, at most one per sample.
Folds folds_of(const TrainingData& data, const TrainingSettings& settings);

/// One checked training; `info` is complete except for its type, id and BetweenRunError.
struct TrainingJob {
  const TrainingData& data;
  compensation::ModelInfo info;
  const TrainingSettings& settings;
  std::vector<int> runs;  ///< recording of each sample
  const TuningProgress& progress;
  const std::atomic<bool>* stop;

  Result<NormalisedData> normalised() const;
};

MethodSummary describe_polynomial(const TrainedModel& trained, const TrainingSettings& settings,
                                  const std::vector<std::string>& names);
MethodSummary describe_kernel(const TrainedModel& trained, const TrainingSettings& settings,
                              const std::vector<std::string>& names);
MethodSummary describe_composite(const TrainedModel& trained, const TrainingSettings& settings,
                                 const std::vector<std::string>& names);

struct Method {
  const char* name;
  const char* help;  ///< added to the name in help texts: when it is the default
  unsigned uses;     ///< MethodUses
  Result<ResourcePlan> (*plan)(Eigen::Index samples, Eigen::Index inputs, const TrainingSettings& settings);
  Result<TrainedModel> (*train)(TrainingJob job);
  MethodSummary (*describe)(const TrainedModel& trained, const TrainingSettings& settings,
                            const std::vector<std::string>& names);

  bool has(MethodUses use) const { return (uses & use) != 0; }
};

/// train() without its checks and without leaving out gross outliers.
Result<TrainedModel> train_checked(const TrainingData& data, compensation::ModelInfo info,
                                   const TrainingSettings& settings, const TuningProgress& progress,
                                   const std::atomic<bool>* stop);

/// All methods, the default first.
std::span<const Method* const> methods();
/// The default; `tuned`: if c, sigma2, a tuning or folds are given.
const Method& default_method(bool tuned);
/// Errors: no method has this name; the message lists all.
Result<const Method*> parse_method(std::string_view name);

/// Names of the methods with one of these uses (0: all methods): "lssvm, ir-lssvm" + `last` + "svr".
std::string method_names(unsigned uses, const char* last = ", ");
/// All names with their help: "composite (default), ls, … or svr".
std::string method_help();

}  // namespace prism::training
