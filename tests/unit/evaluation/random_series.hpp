// SPDX-License-Identifier: MIT
// Seeded noise of known strength for the tests of the evaluation.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace prism::test {

/// Normal numbers by Box and Muller from mt19937_64: the same with every standard library.
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

/// 1/f noise of coefficient B: Ornstein-Uhlenbeck processes, tau from 0.75 samples by fours; the Allan deviation is
/// 0.664 B within 2 % from some 8 samples on.
inline std::vector<double> flicker_noise(std::size_t count, double b, std::uint64_t seed) {
  Normal normal(seed);
  std::vector<double> values(count, 0.0);
  const double sd = b * std::sqrt(std::log(4.0) / std::numbers::pi);
  double tau = 0.75;
  for (int process = 0; process < 12; ++process, tau *= 4) {
    const double kept = std::exp(-1 / tau), fresh = sd * std::sqrt(1 - kept * kept);
    double x = sd * normal();
    for (double& value : values) {
      value += x;
      x = kept * x + fresh * normal();
    }
  }
  return values;
}

/// Removes `holes` single values at equal distances, with a small random shift.
inline std::vector<double> with_holes(std::vector<double> values, std::size_t holes) {
  for (std::size_t i = 1; i <= holes; ++i)
    values[i * values.size() / (holes + 1) + i * 7 % 5] = std::numeric_limits<double>::quiet_NaN();
  return values;
}

}  // namespace prism::test
