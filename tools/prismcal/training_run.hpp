// SPDX-License-Identifier: MIT
// `prismcal train` as a function: trains a model on recordings.
#pragma once

#include <CLI/App.hpp>
#include <atomic>
#include <cstddef>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "compensation/evaluation/data_quality.hpp"
#include "compensation/evaluation/improvement_interval.hpp"
#include "compensation/training/trainer.hpp"
#include "tools/prismcal/method_options.hpp"
#include "tools/prismcal/training_set.hpp"

namespace prism::commands {

// The first sentence: can the model be used, what may be expected of it, what to do next.

/// From parts of the recordings, each predicted by a model of the rest, as prismd would serve it.
struct Expectation {
  int parts = 0;
  std::size_t samples = 0;
  /// 1 − variance of the errors / variance of the bias, within the recordings; below 0: worse than no model.
  double explained = 0;
  /// Of 1 sigma, in another recording of the same profile. Nullopt if the samples do not determine it.
  std::optional<evaluation::Estimate> improvement;
};

/// Returns nullopt if the recordings are too short to hold parts out.
std::optional<Expectation> expectation_of(const training::HeldOutErrors& held_out, const training::TrainingData& data);

/// `explained`, `improvement_percent`, `low_percent`, `high_percent`, `parts`, `samples`; null without an expectation.
nlohmann::ordered_json expectation_json(const std::optional<Expectation>& expected);

enum class Readiness {
  kReady,
  kDoubtful,  ///< the improvement is not distinguishable from none, or the data may be faulty
  kNotReady,
};

const char* readiness_text(Readiness readiness);

struct Judgement {
  Readiness readiness = Readiness::kReady;
  std::string reason;  ///< and what to do; empty if ready
};

/// The attempts of a training, for the advice if its model predicts badly.
struct Attempts {
  std::string method, inputs;  ///< "composite", "T, dTdt, U and a response of 63 min"
  bool all_inputs = false;     ///< the inputs were chosen among all that the recordings have
  bool longer_helps = false;   ///< the recordings are short, or of one passage through the temperatures
  /// Other methods on the same samples, and how much of the held-out parts they explain.
  std::vector<std::pair<std::string, double>> others;
};

/// `questions`: on the data that was used (Recording::questions). `attempts` is called only if the model predicts
/// badly.
Judgement judge(const training::TrainedModel& trained, const std::optional<Expectation>& expected,
                const evaluation::DataQuality& quality, const std::vector<std::string>& questions,
                const std::function<Attempts()>& attempts);

/// "ready: explains 74 % of held-out variation, expected improvement 46 % (31 to 58 %); data quality: pass; next:
/// prismcal evaluate …". One line with its end. `next`: the command that tests the model.
std::string first_sentence(const Judgement& judgement, const std::optional<Expectation>& expected,
                           const evaluation::DataQuality& quality, const std::string& next);

// The training.

struct TrainChoice {
  std::vector<std::string> files;
  std::string inputs = "T,dTdt,U", response = "auto", out, serial, name, prior, from;
  recordings::TrainingSetOptions recordings;
  MethodOptions method;
  bool force = false;
};

struct TrainingRun {
  training::TrainedModel trained;
  recordings::TrainingSet set;      ///< without its recordings
  evaluation::DataQuality quality;  ///< the worst of the recordings
  std::optional<Expectation> expected;
  Judgement judgement;
  Summary summary;  ///< its json is what --json prints

  /// The model file, with its provenance and the current time.
  std::string model_text() const;
};

/// Adds all options of train except the recordings and --out.
void add_train_options(CLI::App& command, TrainChoice& choice);

/// Reads the recordings, checks their quality and trains. Ignores choice.out. Errors: those of `prismcal train`. If the
/// flag `stop` is set, tuning ends early with the best result so far.
Result<TrainingRun> train_on_recordings(const TrainChoice& choice, const std::atomic<bool>* stop = nullptr);

/// A new constant for the model `choice.from`, from the time at rest in the only recording; writes choice.out. The
/// result is what --json prints. Errors: no half hour at rest; a shift within its interval, unless forced.
Result<nlohmann::ordered_json> train_from(const TrainChoice& choice);

}  // namespace prism::commands
