// SPDX-License-Identifier: MIT
#include "compensation/earth_rate.hpp"

#include <algorithm>
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

double mount_sd_deg_per_h(double earth_rate_deg_per_h, double direction_rad) {
  const double along = earth_rate_deg_per_h / kEarthRateDegPerH;
  return direction_rad * kEarthRateDegPerH * std::sqrt(std::max(0.0, 1 - along * along));
}

double azimuth_range_deg_per_h(const AxisPlacement& placement) {
  return 2 * kEarthRateDegPerH *
         std::fabs(std::cos(placement.latitude_deg * kRadPerDeg) * std::cos(placement.elevation_deg * kRadPerDeg));
}

}  // namespace prism::compensation
