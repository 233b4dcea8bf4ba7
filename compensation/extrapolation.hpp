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

/// p = mean + w (f − mean), w = g / (1 + v/var_y + 20 e), e = max(o − 0.15, 0)², g = min(max((r − 0.1)/0.5, 0), 1), and
/// its standard deviations. A prediction without predictive uncertainty is unchanged.
Prediction shrunk(Prediction prediction);

/// The prediction shrunk by a given w, 0 to 1, with its standard deviations:
/// sd² = 1.25 (v + (1 − w)(var_y + (f − mean)²) + nuisance²) + offset², times factor²; sd_mean also includes noise².
Prediction stated(Prediction prediction, const PredictiveUncertainty& known, double w);

}  // namespace prism::compensation
