// SPDX-License-Identifier: MIT
#include "compensation/earth_rate.hpp"

#include <cmath>
#include <numbers>

namespace prism::compensation {

namespace {
constexpr double kRadPerDeg = std::numbers::pi / 180;
}

double earth_rate_deg_per_h(const AxisPlacement& placement) {
  const double phi = placement.latitude_deg * kRadPerDeg;
  const double e = placement.elevation_deg * kRadPerDeg;
  const double a = placement.azimuth_deg * kRadPerDeg;
  return kEarthRateDegPerH * (std::sin(phi) * std::sin(e) + std::cos(phi) * std::cos(e) * std::cos(a));
}

double azimuth_range_deg_per_h(const AxisPlacement& placement) {
  return 2 * kEarthRateDegPerH *
         std::fabs(std::cos(placement.latitude_deg * kRadPerDeg) * std::cos(placement.elevation_deg * kRadPerDeg));
}

}  // namespace prism::compensation
