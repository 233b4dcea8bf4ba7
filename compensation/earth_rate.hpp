// SPDX-License-Identifier: MIT
// The component of the Earth rate that a gyro at rest measures; it is subtracted before training.
#pragma once

namespace prism::compensation {

/// The Earth rate against the stars, deg/h: 360 deg in a sidereal day of 23 h 56 min 4.0905 s (IERS; 7.292115e-5
/// rad/s).
inline constexpr double kEarthRateDegPerH = 15.041067;

/// Site and orientation of the input axis of a gyro.
struct AxisPlacement {
  double latitude_deg = 34.25;  ///< phi, north positive, −90 to 90; the default is Xi'an, the paper's site
  double elevation_deg = 90;    ///< e, of the axis above the horizon, −90 to 90; 90 = up
  double azimuth_deg = 0;       ///< a, of the axis from north over east; has no effect at e = ±90
};

/// Ω (sin φ sin e + cos φ cos e cos a), deg/h.
double earth_rate_deg_per_h(const AxisPlacement& placement);

/// Standard deviation of that rate on an axis whose direction is uncertain by `direction_rad` each way: Ω sin θ, cos θ
/// = rate / Ω.
double mount_sd_deg_per_h(double earth_rate_deg_per_h, double direction_rad);

/// The largest difference that the azimuth can make to north, deg/h: 2 Ω cos φ |cos e|. A smaller one than
/// kAzimuthMatters needs no azimuth.
double azimuth_range_deg_per_h(const AxisPlacement& placement);
inline constexpr double kAzimuthMatters = 0.05;

}  // namespace prism::compensation
