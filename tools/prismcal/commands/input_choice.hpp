// SPDX-License-Identifier: MIT
// `--inputs auto`: chooses inputs by their error on held-out parts of the recordings.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "compensation/training/trainer.hpp"
#include "tools/prismcal/commands/training_run.hpp"

namespace prism::commands {

/// The candidates are the inputs of the first recording. Errors: those of read_training_set() and search_inputs().
Result<training::InputSearch> choose_inputs(const TrainChoice& choice);

/// The result as a readable table and as JSON.
std::string search_text(const training::InputSearch& search);
nlohmann::ordered_json search_json(const training::InputSearch& search);

}  // namespace prism::commands
