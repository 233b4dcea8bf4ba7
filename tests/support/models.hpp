// SPDX-License-Identifier: MIT
// Small models for tests with known results, and an engine that accepts every temperature.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "compensation/compensation_engine.hpp"
#include "compensation/polynomial_model.hpp"

namespace prism::test {

/// bias = offset + Σ gains[i] · inputs[i]
inline compensation::ModelPtr linear_model(std::vector<std::string> inputs, std::vector<double> gains,
                                           double offset_deg_per_h = 0, compensation::FeatureDefinition features = {},
                                           compensation::Domain domain = {}) {
  std::vector<compensation::Term> terms = {{std::vector<int>(inputs.size(), 0), offset_deg_per_h}};
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    compensation::Term term{std::vector<int>(inputs.size(), 0), gains[i]};
    term.powers[i] = 1;
    terms.push_back(std::move(term));
  }
  compensation::ModelInfo info;
  info.kind = "polynomial";
  info.features = std::move(features);
  info.inputs = std::move(inputs);
  info.domain = std::move(domain);
  return std::make_shared<compensation::PolynomialModel>(std::move(info), std::move(terms), 0.001);
}

/// A window that is full after kFullS seconds, to keep tests short.
inline compensation::FeatureDefinition short_features() {
  compensation::FeatureDefinition features;
  features.length_s = 10;
  features.end_mean_s = 2;
  features.max_gap_s = 3;
  return features;
}
inline constexpr int kFullS = 12;  // length_s + end_mean_s

/// For tests with unrealistic temperature steps.
inline compensation::CompensationSettings believing(compensation::CompensationSettings settings = {}) {
  settings.plausibility.temperature = {};
  return settings;
}

}  // namespace prism::test
