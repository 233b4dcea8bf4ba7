// SPDX-License-Identifier: MIT
// Runs the tasks of a campaign with the functions of train and evaluate.
#pragma once

#include "tools/prismcal/campaign/plan.hpp"
#include "tools/prismcal/commands/evaluation_run.hpp"
#include "tools/prismcal/commands/training_run.hpp"

namespace prism::commands {

campaign::Work campaign_work();

/// Parse options as the command line does. Errors: "--method=lq: …".
Result<TrainChoice> train_choice(const std::vector<std::string>& words);
Result<EvaluateChoice> evaluate_choice(const std::vector<std::string>& words);

}  // namespace prism::commands
