// SPDX-License-Identifier: MIT
// What is done with a prediction off the training data: shrunk to the mean, nothing but a flag, or the nearest point of
// the box.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "compensation/model.hpp"

namespace prism::compensation {

enum class Extrapolation {
  kPreset,  ///< what the kind of model was made for: composite kernels are shrunk, the paper's kinds are flagged
  kFlag,    ///< the prediction as it is, marked where it is off the data
  kClamp,   ///< there, the prediction at the nearest point of the training box; the larger of both standard deviations
  kShrink,  ///< shrunk towards the training mean by what the model knows of its ignorance, everywhere: shrunk()
};

/// As configurations and command lines name them, in the order of the enumerators.
inline constexpr std::array kExtrapolationNames = {"preset", "flag", "clamp", "shrink"};
inline const char* extrapolation_name(Extrapolation policy) {
  return kExtrapolationNames[static_cast<std::size_t>(policy)];
}

/// predict(), then the policy where the prediction says `extrapolating`. Models without a box or a variance keep
/// theirs.
Prediction predict_within(const Model& model, std::span<const double> inputs, Extrapolation policy);

/// The point of the training box next to the inputs; the inputs themselves where the model states no box.
std::vector<double> nearest_in_box(const Model& model, std::span<const double> inputs);

/// p = mean + w (f − mean), w = g / (1 + v/var_y + 20 e), e = max(o − 0.15, 0)², g = min(max((r − 0.1)/0.5, 0), 1),
/// and its standard deviations. A prediction without Knowledge stays as it is.
Prediction shrunk(Prediction prediction);

/// The prediction shrunk by a given w, 0 to 1, with the standard deviations that belong to it:
/// sd² = 1.25 (v + (1 − w)(var_y + (f − mean)²) + nuisance²) + offset², times factor²; sd_mean has noise² in it, too.
Prediction stated(Prediction prediction, const Knowledge& known, double w);

}  // namespace prism::compensation
