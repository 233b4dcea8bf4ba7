// SPDX-License-Identifier: MIT
// Random numbers that are the same for the same seed on every machine; std's distributions do not guarantee this.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

namespace prism::simulation {

class RandomSource {
 public:
  /// Streams of one seed are independent: sampling one does not affect the others.
  RandomSource(std::uint64_t seed, std::uint64_t stream)
      : engine_(scramble(seed + 0x9E3779B97F4A7C15u * (stream + 1))) {}

  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

  /// True with this probability; does not use a random number if the probability is 0.
  bool chance(double probability) { return probability > 0 && uniform() < probability; }

  /// Normal with mean 0 and standard deviation 1: Marsaglia's polar method (1964), both numbers of a pair.
  double normal() {
    if (spare_ready_) {
      spare_ready_ = false;
      return spare_;
    }
    double u, v, s;
    do {
      u = 2 * uniform() - 1;
      v = 2 * uniform() - 1;
      s = u * u + v * v;
    } while (s >= 1 || s == 0);
    const double factor = std::sqrt(-2 * std::log(s) / s);
    spare_ = v * factor;
    spare_ready_ = true;
    return u * factor;
  }

 private:
  // Stafford's mix 13 of the splitmix64 finaliser: similar seeds give different engines.
  static std::uint64_t scramble(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
    return x ^ (x >> 31);
  }

  std::mt19937_64 engine_;
  double spare_ = 0;
  bool spare_ready_ = false;
};

}  // namespace prism::simulation
