// SPDX-License-Identifier: MIT
// The result of a training as JSON and as readable lines: the part of each method.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "compensation/training/trainer.hpp"

namespace prism::training {

struct MethodSummary {
  nlohmann::ordered_json json;
  std::string text;  ///< complete lines
};

MethodSummary describe_polynomial(const TrainedModel& trained, const TrainingSettings& settings,
                                  const std::vector<std::string>& names);
MethodSummary describe_kernel(const TrainedModel& trained, const TrainingSettings& settings,
                              const std::vector<std::string>& names);
MethodSummary describe_composite(const TrainedModel& trained, const TrainingSettings& settings,
                                 const std::vector<std::string>& names);

/// "blocked folds", "reml", …
const char* tuning_text(Tuning tuning);

/// The number, or null if it is not finite.
inline nlohmann::ordered_json finite_json(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

}  // namespace prism::training
