// SPDX-License-Identifier: MIT
// Seeded noise of known strength.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace prism::test {

/// Normal random numbers (Box-Muller, mt19937_64): the same with all standard libraries.
class Normal {
 public:
  explicit Normal(std::uint64_t seed) : engine_(seed) {}
  double operator()() {
    const double u = (static_cast<double>(engine_() >> 11) + 0.5) * 0x1p-53;
    const double v = static_cast<double>(engine_() >> 11) * 0x1p-53;
    return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
  }

 private:
  std::mt19937_64 engine_;
};

inline std::vector<double> white_noise(std::size_t count, double sd, std::uint64_t seed) {
  Normal normal(seed);
  std::vector<double> values(count);
  for (double& value : values) value = sd * normal();
  return values;
}

/// The cumulative sum of white noise.
inline std::vector<double> random_walk(std::size_t count, double step_sd, std::uint64_t seed) {
  std::vector<double> values = white_noise(count, step_sd, seed);
  for (std::size_t i = 1; i < count; ++i) values[i] += values[i - 1];
  return values;
}

/// Replaces `gaps` single values by NaN, at nearly equal distances.
inline std::vector<double> with_gaps(std::vector<double> values, std::size_t gaps) {
  for (std::size_t i = 1; i <= gaps; ++i)
    values[i * values.size() / (gaps + 1) + i * 7 % 5] = std::numeric_limits<double>::quiet_NaN();
  return values;
}

}  // namespace prism::test
