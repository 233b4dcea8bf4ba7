// SPDX-License-Identifier: MIT
#include "compensation/extrapolation.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace prism::compensation {
namespace {

Prediction clamped(const Model& model, std::span<const double> inputs, const Prediction& outside) {
  Prediction prediction = model.predict(nearest_in_box(model, inputs));
  prediction.extrapolating = true;
  if (outside.sd_deg_per_h > prediction.sd_deg_per_h) {
    prediction.sd_deg_per_h = outside.sd_deg_per_h;
    prediction.sd_mean_deg_per_h = outside.sd_mean_deg_per_h;
  }
  return prediction;
}

}  // namespace

std::vector<double> nearest_in_box(const Model& model, std::span<const double> inputs) {
  const Domain& domain = model.info().domain;
  std::vector<double> nearest(inputs.begin(), inputs.end());
  for (std::size_t i = 0; i < domain.min.size(); ++i) nearest[i] = std::clamp(nearest[i], domain.min[i], domain.max[i]);
  return nearest;
}

Prediction stated(Prediction prediction, const PredictiveUncertainty& known, double w) {
  // A model estimates its error from one record; another day differs more. Chosen on simulated gyros (docs/science.md).
  constexpr double kStrangeness = 1.25;
  const BetweenRunError& s = known.spread;
  double variance = known.model_variance + s.nuisance_deg_per_h * s.nuisance_deg_per_h;
  if (w != 1) {
    const double from_mean = prediction.bias_deg_per_h - prediction.mean_deg_per_h;
    prediction.bias_deg_per_h = prediction.mean_deg_per_h + w * from_mean;
    variance += (1 - w) * (known.target_variance + from_mean * from_mean);
  }
  variance = kStrangeness * variance + s.offset_deg_per_h * s.offset_deg_per_h;
  prediction.sd_deg_per_h = s.factor * std::sqrt(variance);
  prediction.sd_mean_deg_per_h = s.factor * std::sqrt(variance + s.noise_deg_per_h * s.noise_deg_per_h);
  return prediction;
}

Prediction shrunk(Prediction prediction) {
  if (!prediction.knowledge) return prediction;
  constexpr double kNoSkill = 0.1, kFullSkill = 0.6, kFreeExcess = 0.15, kExcessWeight = 20;
  const PredictiveUncertainty k = *prediction.knowledge;
  const double e = std::pow(std::max(k.excess - kFreeExcess, 0.0), 2);
  const double believed = std::clamp((k.skill - kNoSkill) / (kFullSkill - kNoSkill), 0.0, 1.0);
  const double w = believed / (1 + k.model_variance / k.target_variance + kExcessWeight * e);
  return stated(std::move(prediction), k, w);
}

Prediction predict_within(const Model& model, std::span<const double> inputs, Extrapolation policy) {
  const Prediction prediction = model.predict(inputs);
  const bool shrinks = policy == Extrapolation::kShrink ||
                       (policy == Extrapolation::kPreset && prediction.knowledge && prediction.knowledge->preset);
  if (shrinks) return shrunk(prediction);
  return prediction.extrapolating && policy == Extrapolation::kClamp ? clamped(model, inputs, prediction) : prediction;
}

}  // namespace prism::compensation
