// SPDX-License-Identifier: MIT
#include "compensation/model.hpp"

#include <algorithm>
#include <cmath>

namespace prism::compensation {

bool Model::outside_domain(std::span<const double> inputs) const {
  const Domain& domain = info_.domain;
  for (std::size_t i = 0; i < domain.min.size(); ++i) {
    if (inputs[i] < domain.min[i] || inputs[i] > domain.max[i]) return true;
  }
  return false;
}

double Model::excess(std::span<const double> inputs) const {
  const Domain& domain = info_.domain;
  double most = 0;
  for (std::size_t i = 0; i < domain.min.size(); ++i) {
    const double range = domain.max[i] - domain.min[i];
    if (range > 0) most = std::max(most, std::max(domain.min[i] - inputs[i], inputs[i] - domain.max[i]) / range);
  }
  return most;
}

std::vector<double> gather_inputs(const Model& model, const Window& window) {
  std::vector<double> inputs;
  for (const std::string& name : model.info().inputs) {
    const double value = input_value(window, name);
    if (!std::isfinite(value)) return {};
    inputs.push_back(value);
  }
  return inputs;
}

}  // namespace prism::compensation
