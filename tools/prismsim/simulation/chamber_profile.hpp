// SPDX-License-Identifier: MIT
// Temperature profiles of the simulated thermal chamber: plateaus and ramps.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace prism::simulation {

/// A straight line from the end of the last segment to `end_degc`.
struct ChamberSegment {
  double duration_s = 0;  ///< > 0
  double end_degc = 0;
};

struct ChamberProfile {
  std::string name;
  double start_degc = 25;
  std::vector<ChamberSegment> segments;  ///< ends at start_degc, so that cycles can be repeated

  double duration_s() const;
  /// At any time >= 0; after the last segment the cycle repeats.
  double temperature_degc(double time_s) const;
};

/// The paper's cycle: 2 h at 25 degC, −1 degC/min to −40, 6 h, +1 degC/min to 70, 10 h, −1 degC/min to 25, 4 h: 92 400
/// s.
ChamberProfile paper_profile();
/// Another day within the range of the first: plateaus at 55, −15, −35, 40 degC, ramps of 0.5 to 1.2 degC/min; 92 400
/// s.
ChamberProfile second_profile();
/// A staircase of eight short plateaus between −30 and 65 degC, ramps of 0.7 degC/min, from 10 degC: 92 400 s.
ChamberProfile third_profile();
/// The paper's timetable extended by 15 degC at both ends: −55 and 85 degC; 92 400 s.
ChamberProfile beyond_profile();
/// The paper's plateaus with ramps of 5 degC/min; 92 400 s.
ChamberProfile fast_profile();
/// 25 degC for 92 400 s.
ChamberProfile steady_profile();
/// 25 degC for 4 h: warm-up of a gyro after switch-on.
ChamberProfile warm_up_profile();

/// Profile by name: "paper", "second", "third", "beyond", "fast", "steady", "warm-up". Errors: unknown name.
Result<ChamberProfile> find_profile(std::string_view name);

}  // namespace prism::simulation
