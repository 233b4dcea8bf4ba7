// SPDX-License-Identifier: MIT
// Chamber profiles: the limits of a chamber, the domain that a model must serve, profiles to compare, and the search
// for the best one.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismsim/simulation/chamber_profile.hpp"

namespace prism::design {

struct ChamberLimits {
  double low_degc = -40, high_degc = 70;  ///< low < high
  double rate_degc_per_min = 1;           ///< > 0, of a ramp
  double start_degc = 25;                 ///< of the profile; within the limits
};

/// A closed range of one input, in the input's unit (features.hpp).
struct InputRange {
  std::string input;
  double low = 0, high = 0;  ///< low < high
};

/// "rate<=2 degC/min, T=-45:65"; a missing part keeps its default. Errors: an unknown name or unit, a range whose
/// limits are not in order, a rate that is not positive, a range beyond −200 to
/// 300 degC, a start outside the range.
Result<ChamberLimits> parse_chamber(const std::string& text, double start_degc);

/// "T=-40:60, dTdt=-1:1 degC/min": NAME=LOW:HIGH and a unit, which slopes need (degC/min or degC/s). Errors: as above,
/// an input named twice, no range.
Result<std::vector<InputRange>> parse_domain(const std::string& text);

/// The set-points of a profile, "time_s,temperature_degc": one row per end of a segment, the chamber goes from one to
/// the next in a straight line.
std::string set_points_csv(const simulation::ChamberProfile& profile);

/// The paper's cycle within the limits: its plateaus, the ramps as fast as 1 degC/min or the chamber.
simulation::ChamberProfile paper_within(const ChamberLimits& limits);
/// Profiles that a user would run without a plan: one slow ramp to each end, the same at full speed with soaks, and a
/// staircase over the range.
std::vector<simulation::ChamberProfile> simple_profiles(const ChamberLimits& limits, double hours);

/// The value of a profile, to be minimised; pure.
using ProfileCost = std::function<double(const simulation::ChamberProfile&)>;

struct FoundProfile {
  simulation::ChamberProfile profile;
  double cost = 0;
  int evaluations = 0;
};

/// Visits of temperatures, each a ramp and a soak: one to four of them, up to eight segments, `hours` in all. Tries a
/// family (start cold or hot, number of visits, speed, share of the soaks), then changes temperatures and durations of
/// the best of each number of visits while that helps. Deterministic. Stops after `max_evaluations`.
FoundProfile find_profile(const ChamberLimits& limits, double hours, const ProfileCost& cost, int max_evaluations);

}  // namespace prism::design
