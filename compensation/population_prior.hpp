// SPDX-License-Identifier: MIT
// The population prior: the scaled mean of the models of other gyros of the same type, for a gyro with a short record.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "compensation/model.hpp"

namespace prism::compensation {

/// m(x) = scale · mean over the gyros of (f_s(x) − level_s), each evaluated at the nearest point of its own box.
struct PopulationPrior {
  double scale = 1;              ///< thermal drift of this gyro over that of the others, > 0
  std::vector<ModelPtr> models;  ///< at least two, with the inputs and features of the model that uses them
  std::vector<double> levels;    ///< deg/h, mean of each over its training record: subtracted, because levels differ by
                                 ///< more than the drift

  struct PriorPrediction {
    double mean_deg_per_h = 0;   ///< m(x)
    double variance = 0;         ///< of a gyro about m(x): variance of the models plus that of their mean, (deg/h)²
    bool extrapolating = false;  ///< true if any of the models is outside its training range
  };
  PriorPrediction at(std::span<const double> inputs) const;
};

}  // namespace prism::compensation
