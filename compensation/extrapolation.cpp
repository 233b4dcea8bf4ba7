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

namespace {

// sd of an error with the variance of the model, the nuisance, and `lost` to shrinkage.
Prediction with_deviation(Prediction prediction, const PredictiveUncertainty& known, double lost) {
  // A model estimates its error from one record; another day differs more. Chosen on simulated gyros
  // (docs/benchmarks.md).
  constexpr double kStrangeness = 1.25;
  const BetweenRunError& s = known.spread;
  double variance = known.model_variance + s.nuisance_deg_per_h * s.nuisance_deg_per_h + lost;
  variance = kStrangeness * variance + s.offset_deg_per_h * s.offset_deg_per_h;
  prediction.sd_deg_per_h = s.factor * std::sqrt(variance);
  prediction.sd_mean_deg_per_h = s.factor * std::sqrt(variance + s.noise_deg_per_h * s.noise_deg_per_h);
  return prediction;
}

}  // namespace

Prediction stated(Prediction prediction, const PredictiveUncertainty& known, double w) {
  double lost = 0;
  if (w != 1) {
    const double from_mean = prediction.bias_deg_per_h - prediction.mean_deg_per_h;
    prediction.bias_deg_per_h = prediction.mean_deg_per_h + w * from_mean;
    lost = (1 - w) * (known.target_variance + from_mean * from_mean);
  }
  return with_deviation(std::move(prediction), known, lost);
}

double evidence_of(double skill, double overlap) {
  constexpr double kMissing = 0.9;
  return skill + kMissing * (1 - overlap);
}

Prediction shrunk(Prediction prediction) {
  if (!prediction.knowledge) return prediction;
  constexpr double kFreeExcess = 0.15, kExcessWeight = 20;
  const PredictiveUncertainty k = *prediction.knowledge;
  const double e = std::pow(std::max(k.excess - kFreeExcess, 0.0), 2);
  const double evidence = evidence_of(k.skill, k.overlap);
  const double believed = std::clamp((evidence - kNoSkill) / (kFullSkill - kNoSkill), 0.0, 1.0);
  const double unknown = k.model_variance / k.target_variance;
  if (!k.edge) return stated(std::move(prediction), k, believed / (1 + unknown + kExcessWeight * e));
  // Beyond the edge, the bias at the edge says more than the mean of the record.
  constexpr double kFreeUnknown = 5, kEdgeExcess = 0.5, kBeyondExcess = 10, kTurned = 0.5;
  const double edge_unknown = k.edge->model_variance / k.target_variance;
  const double far = std::max(unknown - edge_unknown - kFreeUnknown, 0.0);
  const double at_edge = believed / (1 + edge_unknown + far + kEdgeExcess * e),
               beyond = believed / (1 + unknown + kBeyondExcess * e);
  const double from_mean = k.edge->bias_deg_per_h - prediction.mean_deg_per_h,
               from_edge = prediction.bias_deg_per_h - k.edge->bias_deg_per_h;
  prediction.bias_deg_per_h = prediction.mean_deg_per_h + at_edge * from_mean + beyond * from_edge;
  const double lost = (1 - at_edge) * (k.target_variance + from_mean * from_mean) +
                      (1 - beyond) * from_edge * from_edge + kTurned * k.excess * k.target_variance;
  return with_deviation(std::move(prediction), k, lost);
}

Prediction predict_within(const Model& model, std::span<const double> inputs, Extrapolation policy) {
  const Prediction prediction = model.predict(inputs);
  const bool shrinks = policy == Extrapolation::kShrink ||
                       (policy == Extrapolation::kPreset && prediction.knowledge && prediction.knowledge->preset);
  if (shrinks) return shrunk(prediction);
  return prediction.extrapolating && policy == Extrapolation::kClamp ? clamped(model, inputs, prediction) : prediction;
}

}  // namespace prism::compensation
