// SPDX-License-Identifier: MIT
// `--inputs auto`: what the recordings can give a model, judged on held-out parts.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "compensation/training/input_search.hpp"
#include "tools/prismcal/commands/training_run.hpp"

namespace prism::commands {

/// Candidates are those of the first recording. Refused: what read_training_set and search_inputs refuse.
Result<training::InputSearch> choose_inputs(const TrainChoice& choice);

/// A table for people, and the same for programs.
std::string search_text(const training::InputSearch& search);
nlohmann::ordered_json search_json(const training::InputSearch& search);

}  // namespace prism::commands
