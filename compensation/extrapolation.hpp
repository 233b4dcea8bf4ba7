// SPDX-License-Identifier: MIT
// Policies for predictions outside the training range: shrink to the mean, flag only, or use the nearest point of the
// training box.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "compensation/model.hpp"

namespace prism::compensation {

enum class Extrapolation {
  kPreset,  ///< the default of the model type: shrink for composite kernels, flag for the paper's types
  kFlag,    ///< the prediction unchanged, flagged outside the training range
  kClamp,  ///< outside, the prediction at the nearest point of the training box; the larger of both standard deviations
  kShrink,  ///< shrunk towards the training mean by the predictive uncertainty, everywhere: shrunk()
};

/// Names in configurations and on command lines, in the order of the enumerators.
inline constexpr std::array kExtrapolationNames = {"preset", "flag", "clamp", "shrink"};
inline const char* extrapolation_name(Extrapolation policy) {
  return kExtrapolationNames[static_cast<std::size_t>(policy)];
}

/// Calls predict(), then applies the policy if the prediction is `extrapolating`. Models without a box or a variance
/// keep their prediction.
Prediction predict_within(const Model& model, std::span<const double> inputs, Extrapolation policy);

/// The point of the training box nearest to the inputs; the inputs themselves if the model has no box.
std::vector<double> nearest_in_box(const Model& model, std::span<const double> inputs);

/// Evidence (evidence_of()) at and below which shrunk() returns the mean, and from which on it uses all of it.
inline constexpr double kNoSkill = 0.1, kFullSkill = 0.6;

/// p = mean + w_b (b − mean) + w_f (f − b), b the bias at the edge of the training range, v_b its variance, and its
/// standard deviations; inside the range b = f. With e = max(o − 0.15, 0)² and g = min(max((evidence − 0.1)/0.5, 0),
/// 1):
///   w_b = g / (1 + v_b/var_y + max((v − v_b)/var_y − 5, 0) + e/2),  w_f = g / (1 + v/var_y + 10 e)
/// Models of version 0.2: b = mean, w_f = g / (1 + v/var_y + 20 e). Without predictive uncertainty the prediction is
/// unchanged.
Prediction shrunk(Prediction prediction);

/// The evidence of one half of the record for the model: r + 0.9 (1 − overlap). Halves that overlap and agree: near 1;
/// that overlap and disagree: at most 0; halves that do not overlap are not evidence against it.
double evidence_of(double skill, double overlap);

/// The prediction shrunk by a given w, 0 to 1, with its standard deviations:
/// sd² = 1.25 (v + (1 − w)(var_y + (f − mean)²) + nuisance²) + offset², times factor²; sd_mean also includes noise².
Prediction stated(Prediction prediction, const PredictiveUncertainty& known, double w);

}  // namespace prism::compensation
