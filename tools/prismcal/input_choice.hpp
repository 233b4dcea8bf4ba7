// SPDX-License-Identifier: MIT
// `--inputs auto`: the smallest set of inputs that predicts held-out parts of the recordings well.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "compensation/training/trainer.hpp"
#include "tools/prismcal/training_run.hpp"

namespace prism::commands {

/// A set of inputs, evaluated by polynomials of second order on contiguous held-out parts of the record.
struct InputSet {
  std::vector<std::string> inputs;
  double error_deg_per_h = 0;           ///< rms over the held-out parts
  double standard_error_deg_per_h = 0;  ///< of that rms, between parts
};

struct InputSearch {
  double without_deg_per_h = 0;  ///< the held-out rms of a constant (the mean)
  std::vector<InputSet> alone;   ///< each candidate alone, in their order
  std::vector<InputSet> path;    ///< each set adds the most helpful candidate to the one before
  std::size_t chosen = 0;        ///< index in path: the smallest set within one standard error of the best

  const InputSet& best() const { return path[chosen]; }
};

/// The possible inputs of the first recording: T, dTdt, U, and for each sensor its difference to T (if in degC, else
/// its value) and its slope. Omits quantities known in 90 % of the blocks or less, and sensors that equal T.
Result<std::vector<std::string>> candidate_inputs(const TrainChoice& choice);

/// Forward selection among the data's inputs, at most six of them. Ignores constant candidates. Errors: all are
/// constant, or fewer than 40 samples.
Result<InputSearch> search_inputs(const training::TrainingData& data);

/// The result as a readable table and as JSON.
std::string search_text(const InputSearch& search);
nlohmann::ordered_json search_json(const InputSearch& search);

}  // namespace prism::commands
