// SPDX-License-Identifier: MIT
// The search for (c, sigma2, weight parameter): a coarse log grid, then simplexes from its best points.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "compensation/training/tuning_cost.hpp"

namespace prism::training {

/// log10 limits of the search, in normalised units.
struct TuningBounds {
  double c_min = -1, c_max = 6.5, sigma2_min = -2, sigma2_max = 2.5;
  double parameter_min = -1.3, parameter_max = 1.3;
};
/// A single input may need a far narrower kernel than several inputs.
TuningBounds bounds_for(Eigen::Index inputs);

struct TuningSettings {
  // Given values stay fixed.
  std::optional<double> c, sigma2, parameter;
  TuningBounds bounds;
  int starts = 0;   ///< number of simplexes; 0: chosen by the size of the data
  int threads = 2;  ///< 1 to 64; the result does not depend on it
};

/// Called from any thread, one call at a time: evaluations done, evaluations expected, best so far.
using TuningProgress = std::function<void(int done, int expected, const TuningPoint& best)>;

struct TuningResult {
  TuningPoint best;                  ///< cost is final_cost()
  std::vector<TuningPoint> surface;  ///< the grid search, in rows of equal sigma2, with its own costs
  int evaluations = 0;
  bool stopped = false;               ///< ended early by the stop flag: the best result so far
  std::vector<std::string> warnings;  ///< a flat cost, an optimum at the edge of the search range
};

/// Deterministic: the same data and settings give the same result on any number of threads.
/// Errors: no parameters have a finite cost.
Result<TuningResult> tune(const TuningCost& cost, Eigen::Index samples, const TuningSettings& settings,
                          const TuningProgress& progress = {}, const std::atomic<bool>* stop = nullptr);

}  // namespace prism::training
