// SPDX-License-Identifier: MIT
// Options of fit, cv and train: the method and its tuning; and the result of a training as text and JSON.
#pragma once

#include <CLI/App.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "compensation/training/trainer.hpp"

namespace prism::commands {

/// The default method if c, sigma2, a tuning or folds are given.
inline constexpr const char* kDefaultTuned = "ir-lssvm";

struct MethodOptions {
  std::string method, tune;  ///< empty: method_name_of(), blocked
  std::string drift;         ///< empty: thermal
  std::string weight, reweight = "converge", scale = "mad", normalise = "zscore";
  std::optional<double> beta, delta;
  std::string start;
  double memory_mb = 1000;
  training::TrainingSettings settings;  ///< the numbers that it has itself: c, sigma2, folds, …
  bool table = false;                   ///< of a table, not of recordings
  bool json = false, quiet = false;
};

void add_method_options(CLI::App& command, MethodOptions& options);

/// The chosen method; without one the composite kernel, or ir-lssvm with c, sigma2 or a tuning, as in version 0.1.
std::string method_name_of(const MethodOptions& options);

/// Options → settings, except polynomial terms. Errors: contradictory options.
Result<training::TrainingSettings> settings_of(const MethodOptions& options);

/// Sets the terms of a polynomial: a cubic of the only input (ls, eq. 21), or those of second order (of a table: the
/// inputs), starting with those of --start, else with T, T^2 and dTdt. Errors: several inputs with ls, an unknown term
/// in --start.
Result<void> set_terms(const MethodOptions& options, const std::vector<std::string>& names,
                       training::TrainingSettings& settings);

/// The result of a training; each value is stated in one place.
struct Summary {
  nlohmann::ordered_json json;  ///< for --json and for the provenance of the model; exact numbers, null if unknown
  std::string text;             ///< readable lines

  /// "  skill          0.79: …": a value with its unit and meaning, or the next value of the same name (empty).
  void line(const std::string& name, const std::string& value);
};
Summary summary_of(const training::TrainedModel& trained, const training::TrainingSettings& settings,
                   const std::vector<std::string>& names);
/// Removes what the model file does not contain: the model id, and the surface of the grid search.
nlohmann::ordered_json provenance_json(nlohmann::ordered_json summary);

}  // namespace prism::commands
