// SPDX-License-Identifier: MIT
#include "drivers/chamber_profile.hpp"

#include <fmt/format.h>

#include <cmath>

namespace prism::drivers {
namespace {

constexpr double kHour = 3600, kMinute = 60;

ChamberSegment hold(double hours, double at_degc) { return {hours * kHour, at_degc}; }

ChamberSegment ramp(double from_degc, double to_degc, double degc_per_min) {
  return {std::abs(to_degc - from_degc) / degc_per_min * kMinute, to_degc};
}

}  // namespace

double ChamberProfile::duration_s() const {
  double total = 0;
  for (const ChamberSegment& segment : segments) total += segment.duration_s;
  return total;
}

double ChamberProfile::temperature_degc(double time_s) const {
  double left = std::fmod(time_s, duration_s());
  double from = start_degc;
  for (const ChamberSegment& segment : segments) {
    if (left < segment.duration_s) return from + (segment.end_degc - from) * left / segment.duration_s;
    left -= segment.duration_s;
    from = segment.end_degc;
  }
  return from;
}

ChamberProfile paper_profile() {
  return {"paper",
          25,
          {hold(2, 25), ramp(25, -40, 1), hold(6, -40), ramp(-40, 70, 1), hold(10, 70), ramp(70, 25, 1), hold(4, 25)}};
}

ChamberProfile second_profile() {
  return {"second",
          25,
          {hold(1.5, 25),
           ramp(25, 55, 0.8),
           hold(5, 55),
           ramp(55, -15, 1.2),
           hold(5.5, -15),
           ramp(-15, -35, 0.5),
           hold(3, -35),
           ramp(-35, 40, 0.9),
           hold(4, 40),
           ramp(40, 25, 0.5),
           {9050, 25}}};
}

ChamberProfile steady_profile() { return {"steady", 25, {{92400, 25}}}; }

Result<ChamberProfile> find_profile(std::string_view name) {
  if (name == "paper") return paper_profile();
  if (name == "second") return second_profile();
  if (name == "steady") return steady_profile();
  return refuse("", fmt::format("found profile \"{}\", expected paper, second or steady", name));
}

}  // namespace prism::drivers
