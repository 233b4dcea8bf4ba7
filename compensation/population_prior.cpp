// SPDX-License-Identifier: MIT
#include "compensation/population_prior.hpp"

#include <algorithm>

#include "compensation/extrapolation.hpp"

namespace prism::compensation {

PopulationPrior::PriorPrediction PopulationPrior::at(std::span<const double> inputs) const {
  const auto count = static_cast<double>(models.size());
  double sum = 0, squares = 0;
  PriorPrediction prediction;
  for (std::size_t s = 0; s < models.size(); ++s) {
    const std::vector<double> nearest = nearest_in_box(*models[s], inputs);
    const double drift = models[s]->bias_deg_per_h(nearest) - levels[s];
    sum += drift;
    squares += drift * drift;
    prediction.extrapolating = prediction.extrapolating || !std::equal(inputs.begin(), inputs.end(), nearest.begin());
  }
  const double mean = sum / count, spread = std::max(0.0, squares - sum * mean) / (count - 1);
  prediction.mean_deg_per_h = scale * mean;
  prediction.variance = scale * scale * spread * (1 + 1 / count);
  return prediction;
}

}  // namespace prism::compensation
