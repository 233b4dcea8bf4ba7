// SPDX-License-Identifier: MIT
// Gyro noises whose Allan variance is known exactly at every cluster size: rates that are averages over a sample.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

namespace prism::test {

/// Normal random numbers (Box-Muller, mt19937_64): the same with all standard libraries.
class NormalPairs {
 public:
  explicit NormalPairs(std::uint64_t seed) : engine_(seed) {}
  double operator()() {
    if (kept_) {
      kept_ = false;
      return second_;
    }
    const double radius = std::sqrt(-2 * std::log(uniform()));
    const double angle = 2 * std::numbers::pi * uniform();
    kept_ = true;
    second_ = radius * std::sin(angle);
    return radius * std::cos(angle);
  }

  /// Above 0 and below 1.
  double uniform() { return (static_cast<double>(engine_() >> 11) + 0.5) * 0x1p-53; }

 private:
  std::mt19937_64 engine_;
  bool kept_ = false;
  double second_ = 0;
};

/// In-place discrete Fourier transform; the size is a power of two.
inline void fourier_transform(std::vector<std::complex<double>>& values) {
  const std::size_t size = values.size();
  for (std::size_t i = 1, j = 0; i < size; ++i) {
    std::size_t bit = size >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) std::swap(values[i], values[j]);
  }
  for (std::size_t length = 2; length <= size; length <<= 1) {
    std::vector<std::complex<double>> turn(length / 2);
    for (std::size_t k = 0; k < turn.size(); ++k)
      turn[k] = std::polar(1.0, -2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(length));
    for (std::size_t i = 0; i < size; i += length) {
      for (std::size_t k = 0; k < length / 2; ++k) {
        const std::complex<double> even = values[i + k];
        const std::complex<double> odd = values[i + k + length / 2] * turn[k];
        values[i + k] = even + odd;
        values[i + k + length / 2] = even - odd;
      }
    }
  }
}

/// Flicker noise of `count` rates. The differences of neighbours are stationary; their covariance is the fourth
/// difference of t² ln|t| / (4 ln 2), and a circulant embedding (Davies and Harte 1987) draws them exactly. The Allan
/// variance is 1 at every cluster size.
class Flicker {
 public:
  explicit Flicker(std::size_t count) : count_(count) {
    std::size_t size = 4;
    while (size < 2 * count) size *= 2;
    roots_.resize(size);
    for (std::size_t k = 0; k < size; ++k) roots_[k] = covariance(std::min(k, size - k));
    fourier_transform(roots_);
    for (auto& root : roots_) root = std::sqrt(std::max(0.0, root.real()) / static_cast<double>(size));
  }

  std::vector<double> operator()(NormalPairs& normal) const { return two(normal).first; }

  /// Two independent records, for the price of one.
  std::pair<std::vector<double>, std::vector<double>> two(NormalPairs& normal) const {
    std::vector<std::complex<double>> values(roots_.size());
    for (std::size_t k = 0; k < values.size(); ++k) {
      const double real = normal(), imaginary = normal();
      values[k] = roots_[k] * std::complex<double>(real, imaginary);
    }
    fourier_transform(values);
    std::vector<double> first(count_), second(count_);
    for (std::size_t i = 1; i < count_; ++i) {
      first[i] = first[i - 1] + values[i].real();
      second[i] = second[i - 1] + values[i].imag();
    }
    return {std::move(first), std::move(second)};
  }

 private:
  static double covariance(std::size_t lag) {
    const auto t = static_cast<long double>(lag);
    if (lag > 1000) return static_cast<double>(-1 / (2 * std::numbers::ln2_v<long double> * t * t));
    const auto r = [](long double x) { return x == 0 ? 0 : x * x * std::log(std::abs(x)); };
    const long double sum = r(t - 2) - 4 * r(t - 1) + 6 * r(t) - 4 * r(t + 1) + r(t + 2);
    return static_cast<double>(sum / (4 * std::numbers::ln2_v<long double>));
  }

  std::size_t count_;
  std::vector<std::complex<double>> roots_;
};

/// Averages of a Wiener process over each sample, step variance 1: the Allan variance is m / 3.
inline std::vector<double> averaged_walk(std::size_t count, NormalPairs& normal) {
  std::vector<double> rates(count);
  double at = 0;
  for (double& rate : rates) {
    const double step = normal();
    rate = at + 0.5 * step + normal() / std::sqrt(12.0);
    at += step;
  }
  return rates;
}

/// Differences of white noise of the angle, variance 1: the Allan variance is 3 / m².
inline std::vector<double> quantised_angle(std::size_t count, NormalPairs& normal) {
  std::vector<double> rates(count);
  double before = normal();
  for (double& rate : rates) {
    const double error = normal();
    rate = error - before;
    before = error;
  }
  return rates;
}

}  // namespace prism::test
