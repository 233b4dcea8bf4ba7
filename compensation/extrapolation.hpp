// SPDX-License-Identifier: MIT
// What is done with a prediction off the training data: nothing but a flag, the nearest point of the box, or a blend.
#pragma once

#include <array>
#include <span>

#include "compensation/model.hpp"

namespace prism::compensation {

enum class Extrapolation {
  kFlag,   ///< the prediction as it is, marked
  kClamp,  ///< the prediction at the nearest point of the training box, marked; the larger of both standard deviations
  kBlend,  ///< trust · prediction + (1 − trust) · the model's linear part or mean, marked; trust = 1 − variance / prior
};

/// As configurations and command lines name them, in the order of the enumerators.
inline constexpr std::array kExtrapolationNames = {"flag", "clamp", "blend"};
inline const char* extrapolation_name(Extrapolation policy) {
  return kExtrapolationNames[static_cast<std::size_t>(policy)];
}

/// predict(), then the policy where the prediction says `extrapolating`. Models without a box or a variance keep
/// theirs.
Prediction predict_within(const Model& model, std::span<const double> inputs, Extrapolation policy);

/// The blend alone, a pure function of the prediction; a prediction that states no mean stays as it is.
Prediction blended(Prediction prediction);

}  // namespace prism::compensation
