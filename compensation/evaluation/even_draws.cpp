// SPDX-License-Identifier: MIT
#include "compensation/evaluation/even_draws.hpp"

#include <boost/math/distributions/normal.hpp>
#include <cstddef>

namespace prism::evaluation {
namespace {

/// The digits of `number` in this base, mirrored at the point: van der Corput's sequence, 0 <= x < 1.
double mirrored_digits(std::size_t number, std::size_t base) {
  double value = 0, digit = 1;
  for (; number > 0; number /= base) {
    digit /= static_cast<double>(base);
    value += static_cast<double>(number % base) * digit;
  }
  return value;
}

}  // namespace

const std::vector<Eigen::Vector4d>& even_normal_draws() {
  static const std::vector<Eigen::Vector4d> draws = [] {
    constexpr std::size_t kPoints = 512;
    constexpr double kHalf = 0.5 / kPoints;
    std::vector<Eigen::Vector4d> result;
    for (std::size_t i = 0; i < kPoints; ++i) {
      Eigen::Vector4d z(static_cast<double>(i) / kPoints, mirrored_digits(i, 2), mirrored_digits(i, 3),
                        mirrored_digits(i, 5));
      for (double& value : z) value = boost::math::quantile(boost::math::normal(), value + kHalf);
      result.push_back(z);
      result.push_back(-z);
    }
    return result;
  }();
  return draws;
}

}  // namespace prism::evaluation
