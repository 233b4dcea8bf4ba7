// SPDX-License-Identifier: MIT
// Runs the tasks of a campaign with the functions of train and evaluate, and estimates their cost.
#pragma once

#include "tools/prismcal/campaign/plan.hpp"
#include "tools/prismcal/commands/evaluation_run.hpp"
#include "tools/prismcal/commands/training_run.hpp"

namespace prism::commands {

/// `calibration`: file with the measured speed of this machine. If a model is not in it, measures it in one or two
/// seconds.
campaign::Work campaign_work(const std::string& calibration);

/// Parse options as the command line does. Errors: "--method=lq: …".
Result<TrainChoice> train_choice(const std::vector<std::string>& words);
Result<EvaluateChoice> evaluate_choice(const std::vector<std::string>& words);

/// Estimates CPU seconds and memory of tasks on this machine. Times one training on synthetic blocks per model and
/// scales it by the length of the recordings.
class CostModel {
 public:
  explicit CostModel(std::string calibration);
  Result<campaign::Cost> cost(const campaign::Task& task, std::uint64_t training_s, std::uint64_t test_s);

 private:
  struct Speed {
    TrainChoice choice;
    double factor = 1;  ///< measured CPU seconds / those of plan_resources(); polynomials: seconds per block
  };
  Result<Speed> speed_of(const campaign::ModelChoice& model);
  Result<double> measure(const TrainChoice& choice) const;
  double read_s_per_row();

  std::string file_;
  Json kept_;
  std::map<std::vector<std::string>, Speed> speeds_;
};

}  // namespace prism::commands
