// SPDX-License-Identifier: MIT
// Selection of model inputs: the smallest set that predicts held-out data well.
#pragma once

#include <string>
#include <vector>

#include "compensation/training/trainer.hpp"

namespace prism::training {

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

/// Forward selection among the data's inputs, at most `most` of them. Ignores constant candidates. Errors: all are
/// constant, or fewer than 40 samples.
Result<InputSearch> search_inputs(const TrainingData& data, std::size_t most = 6);

}  // namespace prism::training
