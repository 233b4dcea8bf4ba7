// SPDX-License-Identifier: MIT
// The search for the chamber profile after which a model states the smallest sd.
#pragma once

#include <functional>

#include "tools/prismcal/design/chamber.hpp"

namespace prism::design {

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
