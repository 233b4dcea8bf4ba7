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

Prediction stated(Prediction prediction, double w) {
  constexpr double kModelShare = 1.5, kNuisanceShare = 2;
  const Knowledge& k = *prediction.knowledge;
  const double from_mean = prediction.bias_deg_per_h - prediction.mean_deg_per_h;
  prediction.bias_deg_per_h = w == 1 ? prediction.bias_deg_per_h : prediction.mean_deg_per_h + w * from_mean;
  const double variance = kModelShare * (k.model_variance + (1 - w) * (k.target_variance + from_mean * from_mean)) +
                          kNuisanceShare * k.nuisance_variance;
  prediction.sd_deg_per_h = k.sd_factor * std::sqrt(variance);
  prediction.sd_mean_deg_per_h = k.sd_factor * std::sqrt(variance + k.noise_variance);
  return prediction;
}

Prediction shrunk(Prediction prediction) {
  if (!prediction.knowledge) return prediction;
  constexpr double kFullSkill = 0.5, kFreeExcess = 0.15, kExcessWeight = 20;
  const Knowledge& k = *prediction.knowledge;
  const double e = std::pow(std::max(k.excess - kFreeExcess, 0.0), 2);
  const double w =
      std::clamp(k.skill / kFullSkill, 0.0, 1.0) / (1 + k.model_variance / k.target_variance + kExcessWeight * e);
  return stated(std::move(prediction), w);
}

Prediction predict_within(const Model& model, std::span<const double> inputs, Extrapolation policy) {
  const Prediction prediction = model.predict(inputs);
  const bool shrinks = policy == Extrapolation::kShrink ||
                       (policy == Extrapolation::kPreset && prediction.knowledge && prediction.knowledge->preset);
  if (shrinks) return shrunk(prediction);
  return prediction.extrapolating && policy == Extrapolation::kClamp ? clamped(model, inputs, prediction) : prediction;
}

}  // namespace prism::compensation
