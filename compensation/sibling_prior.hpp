// SPDX-License-Identifier: MIT
// What other gyros of the same type say of this one before it has a long record: the mean of their models, scaled.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "compensation/model.hpp"

namespace prism::compensation {

/// m(x) = scale · mean over the siblings of (f_s(x) − level_s), each asked at the nearest point of its own box.
struct SiblingPrior {
  double scale = 1;              ///< of this gyro's thermal drift to the siblings', > 0
  std::vector<ModelPtr> models;  ///< at least two, with the inputs and features of the model that uses them
  std::vector<double> levels;    ///< deg/h, of each over the record that was trained: they differ by more than drift

  struct Said {
    double mean_deg_per_h = 0;   ///< m(x)
    double variance = 0;         ///< of a gyro about it: that of the siblings, with the mean's own, (deg/h)²
    bool extrapolating = false;  ///< any of the siblings is off its own data
  };
  Said at(std::span<const double> inputs) const;
};

}  // namespace prism::compensation
