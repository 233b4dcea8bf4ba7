// SPDX-License-Identifier: MIT
// Steps of a conversion chain, forward and inverse.
#include "drivers/wire/description/conversion.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace prism::wire {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// IEC 60751:2008, R(T) = R0 (1 + A T + B T^2 + C (T - 100) T^3), the last term only below 0 degC.
constexpr double kPlatinumA = 3.9083e-3;
constexpr double kPlatinumB = -5.775e-7;
constexpr double kPlatinumC = -4.183e-12;

double interpolate(const std::vector<double>& x, const std::vector<double>& y, double at) {
  const bool rising = x.front() < x.back();
  const double low = rising ? x.front() : x.back();
  const double high = rising ? x.back() : x.front();
  if (!(at >= low && at <= high)) return kNan;
  std::size_t i = 1;
  while (i + 1 < x.size() && (rising ? at > x[i] : at < x[i])) ++i;
  return y[i - 1] + (y[i] - y[i - 1]) * (at - x[i - 1]) / (x[i] - x[i - 1]);
}

struct Forward {
  double x;
  double operator()(const TableStep& s) const { return interpolate(s.x, s.y, x); }
  double operator()(const BridgeStep& s) const { return x >= 0 && x < s.full ? s.reference * x / (s.full - x) : kNan; }
  double operator()(const PlatinumStep& s) const { return platinum_degc(x, s.r0_ohm); }
};

struct Back {
  double y;
  double operator()(const TableStep& s) const { return interpolate(s.y, s.x, y); }
  double operator()(const BridgeStep& s) const { return y >= 0 ? s.full * y / (s.reference + y) : kNan; }
  double operator()(const PlatinumStep& s) const { return platinum_ohm(y, s.r0_ohm); }
};

}  // namespace

double platinum_ohm(double t, double r0_ohm) {
  const double below_zero = t < 0 ? kPlatinumC * (t - 100) * t * t * t : 0;
  return r0_ohm * (1 + kPlatinumA * t + kPlatinumB * t * t + below_zero);
}

// Above 0 degC the quadratic has a closed form. Below, Newton starts from it: the error is at most 2.5 degC at -200
// degC, and it converges quadratically.
double platinum_degc(double resistance_ohm, double r0_ohm) {
  const double ratio = resistance_ohm / r0_ohm;
  if (!(ratio >= 0.1852 && ratio <= 3.9049)) return kNan;
  double t = (-kPlatinumA + std::sqrt(kPlatinumA * kPlatinumA - 4 * kPlatinumB * (1 - ratio))) / (2 * kPlatinumB);
  if (ratio >= 1) return t;
  for (;;) {
    const double f = 1 + t * (kPlatinumA + t * (kPlatinumB + kPlatinumC * (t - 100) * t)) - ratio;
    const double slope = kPlatinumA + t * (2 * kPlatinumB + kPlatinumC * t * (4 * t - 300));
    const double step = f / slope;
    t -= step;
    if (std::abs(step) < 1e-9) return t;
  }
}

double convert(const ConversionStep& step, double x) { return std::visit(Forward{x}, step); }
double convert_back(const ConversionStep& step, double y) { return std::visit(Back{y}, step); }

}  // namespace prism::wire
