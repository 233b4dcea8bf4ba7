// SPDX-License-Identifier: MIT
#include "tools/prismsim/simulation/chamber_profile.hpp"

#include <fmt/format.h>

#include <cmath>

namespace prism::simulation {
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

namespace {

// The paper's timetable with other end temperatures and another speed; the last plateau completes the paper's 92 400 s.
ChamberProfile like_paper(const char* name, double cold_degc, double hot_degc, double degc_per_min) {
  ChamberProfile profile{
      name,
      25,
      {hold(2, 25), ramp(25, cold_degc, degc_per_min), hold(6, cold_degc), ramp(cold_degc, hot_degc, degc_per_min),
       hold(10, hot_degc), ramp(hot_degc, 25, degc_per_min)}};
  profile.segments.push_back({92400 - profile.duration_s(), 25});
  return profile;
}

}  // namespace

ChamberProfile paper_profile() { return like_paper("paper", -40, 70, 1); }
ChamberProfile beyond_profile() { return like_paper("beyond", -55, 85, 1); }
ChamberProfile fast_profile() { return like_paper("fast", -40, 70, 5); }

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

ChamberProfile third_profile() {
  ChamberProfile profile{"third", 10, {hold(1, 10)}};
  double from = 10;
  for (const double to : {-10.0, -30.0, -5.0, 20.0, 45.0, 65.0, 35.0, 10.0}) {
    profile.segments.push_back(ramp(from, to, 0.7));
    profile.segments.push_back(hold(2.2, to));
    from = to;
  }
  profile.segments.push_back({92400 - profile.duration_s(), 10});
  return profile;
}

ChamberProfile steady_profile() { return {"steady", 25, {{92400, 25}}}; }
ChamberProfile warm_up_profile() { return {"warm-up", 25, {hold(4, 25)}}; }

Result<ChamberProfile> find_profile(std::string_view name) {
  std::string names;
  for (const auto& profile : {paper_profile(), second_profile(), third_profile(), beyond_profile(), fast_profile(),
                              steady_profile(), warm_up_profile()}) {
    if (name == profile.name) return profile;
    names += (names.empty() ? "" : ", ") + profile.name;
  }
  return make_error("", fmt::format("found profile \"{}\", expected one of {}", name, names));
}

}  // namespace prism::simulation
