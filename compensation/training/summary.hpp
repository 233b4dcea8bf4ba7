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
  std::string text;  ///< lines of detail_line()
};

/// "  skill          0.79: …": a value with its unit and meaning, or the next value of the same name (empty).
std::string detail_line(const std::string& name, const std::string& text);
/// "deg/h", or "units of the target" for a model of a table.
std::string target_unit(const TrainedModel& trained);
/// `value` with `digits` significant digits, and without an exponent from 1e-7 to 1e9: 170, 0.0004.
std::string plain_number(double value, int digits);

/// "blocked folds", "reml", …
const char* tuning_text(Tuning tuning);

/// The number, or null if it is not finite.
inline nlohmann::ordered_json finite_json(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

}  // namespace prism::training
