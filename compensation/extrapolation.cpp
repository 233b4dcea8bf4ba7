// SPDX-License-Identifier: MIT
#include "compensation/extrapolation.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace prism::compensation {
namespace {

Prediction clamped(const Model& model, std::span<const double> inputs, const Prediction& outside) {
  const Domain& domain = model.info().domain;
  if (domain.min.size() != inputs.size()) return outside;
  std::vector<double> nearest(inputs.begin(), inputs.end());
  for (std::size_t i = 0; i < nearest.size(); ++i) nearest[i] = std::clamp(nearest[i], domain.min[i], domain.max[i]);
  Prediction prediction = model.predict(nearest);
  prediction.extrapolating = true;
  if (outside.sd_deg_per_h > prediction.sd_deg_per_h) prediction.sd_deg_per_h = outside.sd_deg_per_h;
  return prediction;
}

}  // namespace

Prediction blended(Prediction prediction) {
  if (!std::isfinite(prediction.mean_deg_per_h)) return prediction;
  const double trust = prediction.trust;
  prediction.bias_deg_per_h = trust * prediction.bias_deg_per_h + (1 - trust) * prediction.mean_deg_per_h;
  return prediction;
}

Prediction predict_within(const Model& model, std::span<const double> inputs, Extrapolation policy) {
  const Prediction prediction = model.predict(inputs);
  if (!prediction.extrapolating || policy == Extrapolation::kFlag) return prediction;
  return policy == Extrapolation::kClamp ? clamped(model, inputs, prediction) : blended(prediction);
}

}  // namespace prism::compensation
