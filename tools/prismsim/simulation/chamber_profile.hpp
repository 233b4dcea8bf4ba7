// SPDX-License-Identifier: MIT
// What the thermal chamber of a simulated test does over time: plateaus and ramps.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace prism::simulation {

/// A straight line from where the last segment ended to `end_degc`.
struct ChamberSegment {
  double duration_s = 0;  ///< > 0
  double end_degc = 0;
};

struct ChamberProfile {
  std::string name;
  double start_degc = 25;
  std::vector<ChamberSegment> segments;  ///< ends at start_degc, so that cycles can follow each other

  double duration_s() const;
  /// At any time >= 0; after the last segment the cycle begins again.
  double temperature_degc(double time_s) const;
};

/// The paper's cycle: 2 h at 25 degC, −1 degC/min to −40, 6 h, +1 degC/min to 70, 10 h, −1 degC/min to 25, 4 h: 92 400
/// s.
ChamberProfile paper_profile();
/// Another day within the range of the first: plateaus at 55, −15, −35, 40 degC, ramps of 0.5 to 1.2 degC/min: 92 400
/// s.
ChamberProfile second_profile();
/// A staircase of eight short plateaus between −30 and 65 degC, ramps of 0.7 degC/min, from 10 degC: 92 400 s.
ChamberProfile third_profile();
/// The paper's timetable 15 degC further out at both ends: −55 and 85 degC; 92 400 s.
ChamberProfile beyond_profile();
/// The paper's plateaus with ramps of 5 degC/min; 92 400 s.
ChamberProfile fast_profile();
/// 25 degC for 92 400 s.
ChamberProfile steady_profile();
/// 25 degC for 4 h: what a gyro that was just switched on shows by itself.
ChamberProfile warm_up_profile();

/// By its name: "paper", "second", "third", "beyond", "fast", "steady", "warm-up". Refused: any other name.
Result<ChamberProfile> find_profile(std::string_view name);

}  // namespace prism::simulation
