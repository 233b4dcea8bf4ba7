// SPDX-License-Identifier: MIT
// The part of the earth's rotation that a gyro at rest sees: what must go before the rest is bias.
#pragma once

namespace prism::compensation {

/// The earth's rotation against the stars, deg/h: 360 deg in a sidereal day of 23 h 56 min 4.0905 s (IERS; 7.292115e-5
/// rad/s).
inline constexpr double kEarthRateDegPerH = 15.041067;

/// Where a gyro stands and where its input axis points.
struct AxisPlacement {
  double latitude_deg = 34.25;  ///< phi, north positive, −90 to 90; the default is Xi'an, where the paper's gyro stood
  double elevation_deg = 90;    ///< e, of the axis above the horizon, −90 to 90; 90 = up
  double azimuth_deg = 0;       ///< a, of the axis from north over east; without meaning at e = ±90
};

/// Ω (sin φ sin e + cos φ cos e cos a), deg/h.
double earth_rate_deg_per_h(const AxisPlacement& placement);

}  // namespace prism::compensation
