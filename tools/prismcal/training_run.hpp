// SPDX-License-Identifier: MIT
// `prismcal train` as a function: trains a model on recordings.
#pragma once

#include <CLI/App.hpp>
#include <atomic>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/prismcal/method_options.hpp"
#include "tools/prismcal/readiness.hpp"
#include "tools/prismcal/training_set.hpp"

namespace prism::commands {

struct TrainChoice {
  std::vector<std::string> files;
  std::string inputs = "T,dTdt,U", response = "auto", out, serial, name, prior, from;
  recordings::TrainingSetOptions recordings;
  MethodOptions method;
  bool force = false;
};

struct TrainingRun {
  training::TrainedModel trained;
  recordings::TrainingSet set;  ///< without its recordings
  training::TrainingSettings settings;
  evaluation::DataQuality quality;  ///< the worst of the recordings
  std::optional<Expectation> expected;
  Judgement judgement;
  nlohmann::ordered_json summary;  ///< what --json prints

  /// The model file, with its provenance and the current time.
  std::string model_text() const;
};

/// Adds all options of train except the recordings and --out.
void add_train_options(CLI::App& command, TrainChoice& choice);

/// Reads the recordings, checks their quality and trains. Ignores choice.out. Errors: those of `prismcal train`. `stop`
/// is called when training begins; if the flag it returns is set, tuning ends early with the best result so far.
Result<TrainingRun> train_on_recordings(const TrainChoice& choice, const std::atomic<bool>* (*stop)() = nullptr);

/// A new constant for the model `choice.from`, from the time at rest in the only recording; writes choice.out. The
/// result is what --json prints. Errors: no half hour at rest; a shift within its interval, unless forced.
Result<nlohmann::ordered_json> train_from(const TrainChoice& choice);

}  // namespace prism::commands
