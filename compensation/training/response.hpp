// SPDX-License-Identifier: MIT
// A thermometer outside the gyro: the time constant with which the gyro's body follows it, from the training samples.
#pragma once

#include <optional>

#include "compensation/training/trainer.hpp"

namespace prism::training {

struct ResponseSearch {
  int tau_s = 0;                 ///< 0: the temperature as measured
  double low_s = 0, high_s = 0;  ///< 95 % interval
  double gain = 0;               ///< of the log likelihood, over the temperature as measured
};

/// The time constant, up to 4 h, with which samples of the temperature as measured have the largest restricted
/// likelihood of the composite kernel; 0 if it is not clearly better, by this likelihood and that of held-out blocks.
/// Nullopt if the samples cannot tell: of less than 8 h, of one passage through the temperatures, without T or dTdt
/// (for whose lack the response would stand), or with other inputs that depend on it. Uses means of neighbouring
/// samples, about 200: it costs about as much as training on 1000 samples. `length_s`: of the blocks.
std::optional<ResponseSearch> find_response(const TrainingData& data, const TrainingSettings& settings,
                                            double length_s);

}  // namespace prism::training
