// SPDX-License-Identifier: MIT
// Runs a campaign's tasks by the functions of train and evaluate, and estimates their cost.
#pragma once

#include "tools/prismcal/campaign/plan.hpp"
#include "tools/prismcal/commands/evaluation_run.hpp"
#include "tools/prismcal/commands/training_run.hpp"

namespace prism::commands {

/// `calibration`: the file that keeps how fast this machine is; it is measured, in a second or two for each model,
/// where the file does not know.
campaign::Work campaign_work(const std::string& calibration);

/// Words → options, as the command line would take them. Errors: "--method=lq: …".
Result<TrainChoice> train_choice(const std::vector<std::string>& words);
Result<EvaluateChoice> evaluate_choice(const std::vector<std::string>& words);

/// Seconds and memory of tasks on this machine: a training on made-up blocks is timed once for each model, the rest is
/// in proportion to the recordings.
class CostModel {
 public:
  explicit CostModel(std::string calibration);
  Result<campaign::Cost> cost(const campaign::Task& task, std::uint64_t training_s, std::uint64_t judged_s);

 private:
  struct Speed {
    TrainChoice choice;
    double factor = 1;  ///< measured CPU seconds over those of the resource plan; of polynomials, seconds a block
  };
  Result<Speed> speed_of(const campaign::ModelChoice& model);
  Result<double> measure(const TrainChoice& choice) const;
  double read_s_per_row();

  std::string file_;
  Json kept_;
  std::map<std::vector<std::string>, Speed> speeds_;
};

}  // namespace prism::commands
