// SPDX-License-Identifier: MIT
// Which inputs a model should have: those that foretell what was held out, and no more.
#pragma once

#include <string>
#include <vector>

#include "compensation/training/trainer.hpp"

namespace prism::training {

/// A set of inputs, judged by polynomials of second order on contiguous held-out parts of the record.
struct InputSet {
  std::vector<std::string> inputs;
  double error_deg_per_h = 0;           ///< rms over what was held out
  double standard_error_deg_per_h = 0;  ///< of it, from part to part
};

struct InputSearch {
  double without_deg_per_h = 0;  ///< the held-out rms of the mean alone
  std::vector<InputSet> alone;   ///< each candidate by itself, in their order
  std::vector<InputSet> path;    ///< each the one before and the candidate that helps it most
  std::size_t chosen = 0;        ///< of the path: the smallest within one standard error of the best

  const InputSet& best() const { return path[chosen]; }
};

/// Forward selection among the data's inputs, at most `most` of them. Candidates that do not move are left out.
/// Refused: none moves, or fewer than 40 samples.
Result<InputSearch> search_inputs(const TrainingData& data, std::size_t most = 6);

}  // namespace prism::training
