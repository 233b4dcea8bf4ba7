// SPDX-License-Identifier: MIT
// One-second means with a known bias for the tests of prismcal.
#pragma once

#include <cmath>
#include <span>
#include <vector>

#include "compensation/polynomial_model.hpp"
#include "compensation/second_averager.hpp"
#include "tests/support/random_series.hpp"
#include "tools/prismcal/block_table.hpp"

namespace prism::recordings {

/// Blocks of seconds in memory. `sessions`: index of the first second of each; empty: one session.
inline Result<BlockTable> make_block_table(std::span<const compensation::SecondMean> second_means,
                                           const compensation::FeatureDefinition& features, double earth_rate_deg_per_h,
                                           const std::string& name, std::span<const std::size_t> sessions = {}) {
  BlockTableBuilder builder(features, earth_rate_deg_per_h, name);
  std::size_t session = 0;
  for (std::size_t i = 0; i < second_means.size(); ++i) {
    const bool begins = session < sessions.size() && sessions[session] == i;
    session += begins;
    if (auto done = builder.push(second_means[i], begins); !done) return tl::unexpected<Error>(done.error());
  }
  return builder.finish();
}

}  // namespace prism::recordings

namespace prism::test {

inline constexpr double kDayEarthRate = 8.4652, kDaySensitivity = 5e-4;

/// `seconds` of 1 Hz data: T is a sine of 15 ± 40 degC with a period of 8 000 s, U decreases with T, bias =
/// kDaySensitivity · T, 1 sigma of a second = `noise_deg_per_h`.
inline std::vector<compensation::SecondMean> simulated_day(int seconds, double noise_deg_per_h, std::uint64_t seed) {
  Normal normal(seed);
  std::vector<compensation::SecondMean> second_means;
  for (int i = 0; i < seconds; ++i) {
    compensation::SecondMean second_mean;
    second_mean.second = 1767225600 + i;
    second_mean.samples = 1;
    second_mean.temperature_degc = 15 + 40 * std::sin(i * 2 * std::numbers::pi / 8000);
    second_mean.uhfo_v = 5.5 - 0.003 * second_mean.temperature_degc + 0.001 * normal();
    second_mean.rate_deg_per_h =
        kDayEarthRate + kDaySensitivity * second_mean.temperature_degc + noise_deg_per_h * normal();
    second_means.push_back(second_mean);
  }
  return second_means;
}

/// bias = sensitivity · T
inline compensation::ModelPtr linear_model(double sensitivity, const compensation::FeatureDefinition& features = {}) {
  compensation::ModelInfo info;
  info.kind = "polynomial";
  info.name = "line";
  info.features = features;
  info.inputs = {"T"};
  return std::make_shared<compensation::PolynomialModel>(info, std::vector<compensation::Term>{{{1}, sensitivity}});
}

}  // namespace prism::test
