// SPDX-License-Identifier: MIT
#include "tools/prismcal/profiles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "base/escape.hpp"
#include "compensation/features.hpp"

namespace prism::design {
namespace {

constexpr double kHour_s = 3600, kMinute_s = 60;
constexpr const char* kRate = "rate";

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
  return first == std::string_view::npos ? std::string_view() : text.substr(first, last - first + 1);
}

// "NAME=LOW:HIGH UNIT" or "NAME<=HIGH UNIT".
struct Statement {
  std::string name, unit;
  std::optional<double> low;
  double high = 0;
};

// Reads one number; the rest of `text` remains.
std::optional<double> number_at(std::string_view& text) {
  text = trimmed(text);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

std::optional<Statement> statement_of(std::string_view text) {
  Statement s;
  const bool limit = text.find("<=") != std::string_view::npos;
  const auto sign = text.find(limit ? "<=" : "=");
  if (sign == std::string_view::npos) return std::nullopt;
  s.name = trimmed(text.substr(0, sign));
  text.remove_prefix(sign + (limit ? 2 : 1));
  if (!limit) {
    s.low = number_at(text);
    if (!s.low || text.empty() || text.front() != ':') return std::nullopt;
    text.remove_prefix(1);
  }
  const auto high = number_at(text);
  if (s.name.empty() || !high) return std::nullopt;
  s.high = *high;
  s.unit = trimmed(text);
  return s;
}

Result<std::vector<Statement>> statements_of(std::string_view text, const char* where, const char* expected) {
  std::vector<Statement> all;
  while (true) {
    const auto comma = text.find(',');
    const std::string_view part = trimmed(text.substr(0, comma));
    const auto s = statement_of(part);
    if (!s) return make_error(where, fmt::format("found \"{}\", expected {}", shortened(part), expected));
    if (s->low && !(*s->low < s->high))
      return make_error(
          where, fmt::format("{}: found {}:{}, expected the lower limit first", shortened(s->name), *s->low, s->high));
    all.push_back(*s);
    if (comma == std::string_view::npos) return all;
    text.remove_prefix(comma + 1);
  }
}

// Factor to degC/s.
std::optional<double> slope_factor(const std::string& unit) {
  if (unit == "degC/min") return 1 / kMinute_s;
  if (unit == "degC/s") return 1;
  return std::nullopt;
}

simulation::ChamberProfile profile_from(const char* name, const ChamberLimits& limits) {
  return {name, limits.start_degc, {}};
}

// A ramp at this rate, then a soak.
void add_visit(simulation::ChamberProfile& profile, double degc, double degc_per_min, double soak_s) {
  const double from = profile.segments.empty() ? profile.start_degc : profile.segments.back().end_degc;
  if (from != degc) profile.segments.push_back({std::abs(degc - from) / degc_per_min * kMinute_s, degc});
  if (soak_s > 0) profile.segments.push_back({soak_s, degc});
}

// Temperatures that no gyro meets are a wrong unit.
Result<void> check_range(double low_degc, double high_degc, const char* where) {
  constexpr double kColdest_degc = -200, kHottest_degc = 300;
  if (low_degc >= kColdest_degc && high_degc <= kHottest_degc) return {};
  return make_error(where, fmt::format("T: found {}:{}, expected limits within {} to {} degC", low_degc, high_degc,
                                       kColdest_degc, kHottest_degc));
}

constexpr double kGrid_min = 1;  // durations are multiples of it
constexpr std::size_t kMostVisits = 4;
constexpr double kShortest_degc = 1;  // a smaller step is not a ramp

struct Visit {
  double degc = 0, ramp_min = 0, soak_min = 0;
};
using Visits = std::vector<Visit>;

simulation::ChamberProfile profile_of(const Visits& visits, const ChamberLimits& limits) {
  simulation::ChamberProfile profile{"designed", limits.start_degc, {}};
  for (const Visit& v : visits) {
    if (v.ramp_min > 0) profile.segments.push_back({v.ramp_min * 60, v.degc});
    if (v.soak_min > 0) profile.segments.push_back({v.soak_min * 60, v.degc});
  }
  return profile;
}

// Makes the visits possible: temperatures within the limits, ramps no faster than the chamber, `total_min` in all. Time
// that is missing is taken from the soaks, then from slow ramps; time left over is added to the last soak.
std::optional<Visits> possible(Visits visits, const ChamberLimits& limits, double total_min) {
  double from = limits.start_degc, sum = 0, soaks = 0, slack = 0;
  std::vector<double> fastest;
  for (Visit& v : visits) {
    v.degc = std::clamp(std::round(v.degc), limits.low_degc, limits.high_degc);
    fastest.push_back(std::ceil(std::abs(v.degc - from) / limits.rate_degc_per_min / kGrid_min) * kGrid_min);
    v.ramp_min = std::abs(v.degc - from) < kShortest_degc ? 0 : std::max(v.ramp_min, fastest.back());
    v.soak_min = std::max(v.soak_min, 0.0);
    from = v.degc;
    sum += v.ramp_min + v.soak_min;
    soaks += v.soak_min;
    slack += std::max(0.0, v.ramp_min - fastest.back());
  }
  const double missing = sum - total_min;
  const double from_soaks = std::clamp(missing, 0.0, soaks), from_ramps = std::max(0.0, missing - from_soaks);
  if (from_ramps > slack) return std::nullopt;
  sum = 0;
  for (std::size_t i = 0; i < visits.size(); ++i) {
    Visit& v = visits[i];
    if (soaks > 0) v.soak_min -= std::ceil(from_soaks * v.soak_min / soaks / kGrid_min) * kGrid_min;
    const double spare = std::max(0.0, v.ramp_min - fastest[i]);
    if (slack > 0) v.ramp_min -= std::min(spare, std::ceil(from_ramps * spare / slack));
    v.soak_min = std::max(v.soak_min, 0.0);
    sum += v.ramp_min + v.soak_min;
  }
  visits.back().soak_min += total_min - sum;
  return visits;
}

}  // namespace

Result<ChamberLimits> parse_chamber(const std::string& text, double start_degc) {
  constexpr const char* kWhere = "--chamber";
  ChamberLimits limits;
  limits.start_degc = start_degc;
  if (!text.empty()) {
    const auto all = statements_of(text, kWhere, "\"rate<=2 degC/min\" or \"T=-45:65\"");
    if (!all) return tl::unexpected<Error>(all.error());
    for (const Statement& s : *all) {
      if (s.name == kRate && !s.low) {
        if (!s.unit.empty() && !slope_factor(s.unit))
          return make_error(kWhere, fmt::format("found unit \"{}\", expected degC/min or degC/s", shortened(s.unit)));
        limits.rate_degc_per_min = s.unit == "degC/s" ? s.high * kMinute_s : s.high;
      } else if (s.name == compensation::kInputTemperature && s.low && (s.unit.empty() || s.unit == "degC")) {
        limits.low_degc = *s.low;
        limits.high_degc = s.high;
      } else {
        return make_error(
            kWhere, fmt::format("found \"{}\", expected \"rate<=2 degC/min\" or \"T=-45:65\"", shortened(s.name)));
      }
    }
  }
  if (!(limits.rate_degc_per_min > 0))
    return make_error(kWhere,
                      fmt::format("found a rate of {} degC/min, expected a positive one", limits.rate_degc_per_min));
  if (auto good = check_range(limits.low_degc, limits.high_degc, kWhere); !good)
    return tl::unexpected<Error>(good.error());
  if (start_degc < limits.low_degc || start_degc > limits.high_degc)
    return make_error("--start", fmt::format("found {} degC, expected {} to {}, the limits of the chamber", start_degc,
                                             limits.low_degc, limits.high_degc));
  return limits;
}

Result<std::vector<InputRange>> parse_domain(const std::string& text) {
  constexpr const char* kWhere = "--domain";
  const auto all = statements_of(text, kWhere, "NAME=LOW:HIGH, for example \"T=-40:60, dTdt=-1:1 degC/min\"");
  if (!all) return tl::unexpected<Error>(all.error());
  std::vector<InputRange> domain;
  for (const Statement& s : *all) {
    if (!s.low)
      return make_error(kWhere,
                        fmt::format("{}: found <=, expected {}=LOW:HIGH", shortened(s.name), shortened(s.name)));
    double factor = 1;
    if (s.name == compensation::kInputTemperature) {
      if (!s.unit.empty() && s.unit != "degC")
        return make_error(kWhere, fmt::format("T: found unit \"{}\", expected degC", shortened(s.unit)));
      if (auto good = check_range(*s.low, s.high, kWhere); !good) return tl::unexpected<Error>(good.error());
    } else if (compensation::is_slope(s.name)) {
      const auto found = slope_factor(s.unit);
      if (!found)
        return make_error(kWhere, fmt::format("{}: found unit \"{}\", expected degC/min or degC/s", shortened(s.name),
                                              shortened(s.unit)));
      factor = *found;
    }
    if (std::any_of(domain.begin(), domain.end(), [&](const InputRange& r) { return r.input == s.name; }))
      return make_error(kWhere, fmt::format("found {} twice, expected it once", shortened(s.name)));
    domain.push_back({s.name, *s.low * factor, s.high * factor});
  }
  return domain;
}

std::string set_points_csv(const simulation::ChamberProfile& profile) {
  std::string text = fmt::format("time_s,temperature_degc\n0,{:.1f}\n", profile.start_degc);
  double time_s = 0;
  for (const simulation::ChamberSegment& segment : profile.segments) {
    time_s += segment.duration_s;
    text += fmt::format("{:.0f},{:.1f}\n", time_s, segment.end_degc);
  }
  return text;
}

simulation::ChamberProfile paper_within(const ChamberLimits& limits) {
  simulation::ChamberProfile profile = profile_from("the paper's cycle", limits);
  const double rate = std::min(1.0, limits.rate_degc_per_min);
  add_visit(profile, limits.start_degc, rate, 2 * kHour_s);
  add_visit(profile, std::max(-40.0, limits.low_degc), rate, 6 * kHour_s);
  add_visit(profile, std::min(70.0, limits.high_degc), rate, 10 * kHour_s);
  add_visit(profile, limits.start_degc, rate, 4 * kHour_s);
  return profile;
}

std::vector<simulation::ChamberProfile> simple_profiles(const ChamberLimits& limits, double hours) {
  const double total_s = hours * kHour_s, fastest = limits.rate_degc_per_min;
  const double path = limits.start_degc - limits.low_degc + limits.high_degc - limits.low_degc;
  const auto soak_s = [&](int soaks) { return std::max(0.0, total_s - path / fastest * kMinute_s) / soaks; };
  simulation::ChamberProfile slow = profile_from("slow ramp", limits);
  const double rate = std::min(fastest, path / (total_s / kMinute_s));
  add_visit(slow, limits.low_degc, rate, 0);
  add_visit(slow, limits.high_degc, rate, 0);
  simulation::ChamberProfile fast = profile_from("fast ramp", limits);
  add_visit(fast, limits.low_degc, fastest, soak_s(2));
  add_visit(fast, limits.high_degc, fastest, soak_s(2));
  constexpr int kSteps = 6;
  simulation::ChamberProfile stairs = profile_from("staircase", limits);
  for (int k = 0; k < kSteps; ++k) {
    const double share = static_cast<double>(k) / (kSteps - 1);
    add_visit(stairs, limits.low_degc + share * (limits.high_degc - limits.low_degc), fastest, soak_s(kSteps));
  }
  return {slow, fast, stairs};
}

FoundProfile find_profile(const ChamberLimits& limits, double hours, const ProfileCost& cost, int max_evaluations) {
  struct Tried {
    Visits visits;
    double cost = std::numeric_limits<double>::infinity();
  };
  const double total_min = std::floor(hours * 60 / kGrid_min) * kGrid_min;
  int evaluations = 0;
  // Keeps the candidate if it is possible and better.
  const auto improve = [&](Tried& best, const Visits& candidate) {
    const auto visits = evaluations < max_evaluations ? possible(candidate, limits, total_min) : std::nullopt;
    if (!visits) return false;
    ++evaluations;
    const double own = cost(profile_of(*visits, limits));
    if (!(own < best.cost)) return false;
    best = {*visits, own};
    return true;
  };
  // A member of the family with this number of visits. `early`: share of the soaks; 0: all at the end, 1: all before.
  const auto member = [&](std::size_t count, bool cold_first, double speed, double reach, double early) {
    Visits visits;
    double from = limits.start_degc, left = total_min;
    for (std::size_t i = 0; i < count; ++i) {
      const double end = cold_first == (i % 2 == 0) ? limits.low_degc : limits.high_degc;
      const double degc = std::round(limits.start_degc + reach * (end - limits.start_degc));
      visits.push_back({degc, std::abs(degc - from) / limits.rate_degc_per_min / speed, 0});
      from = degc;
      left -= visits.back().ramp_min;
    }
    for (Visit& v : visits) v.soak_min = std::max(0.0, early * left / static_cast<double>(count));
    return visits;
  };
  const auto part = [](Visits& visits, std::size_t i) -> double& {
    return i % 2 ? visits[i / 2].soak_min : visits[i / 2].ramp_min;
  };
  const auto change = [&](Tried& best, std::size_t i, double by_degc) {
    Visits changed = best.visits;
    changed[i].degc += by_degc;
    return improve(best, changed);
  };
  const auto move = [&](Tried& best, std::size_t from, std::size_t to, double minutes) {
    Visits changed = best.visits;
    const double taken = std::min(minutes, part(changed, from));
    if (taken < kGrid_min) return false;
    part(changed, from) -= taken;
    part(changed, to) += taken;
    return improve(best, changed);
  };
  // Changes one temperature (by 16 degC times the step), or moves time from one part to another (48 min), while that
  // helps.
  const auto polish = [&](Tried& best, std::initializer_list<double> steps) {
    for (const double step : steps) {
      bool better = true;
      for (int round = 0; better && round < 3; ++round) {
        better = false;
        for (std::size_t i = 0; i < best.visits.size(); ++i)
          better |= change(best, i, -16 * step) || change(best, i, 16 * step);
        for (std::size_t from = 0; from < 2 * best.visits.size(); ++from) {
          for (std::size_t to = 0; to < 2 * best.visits.size(); ++to)
            better |= from != to && move(best, from, to, 48 * step);
        }
      }
    }
  };
  std::vector<Tried> starts(kMostVisits);
  for (std::size_t count = 1; count <= kMostVisits; ++count) {
    for (const bool cold_first : {true, false}) {
      for (const double speed : {1.0, 0.5, 0.25}) {
        for (const double reach : {1.0, 0.8}) {
          for (const double early : {0.0, 0.5, 1.0})
            improve(starts[count - 1], member(count, cold_first, speed, reach, early));
        }
      }
    }
  }
  std::stable_sort(starts.begin(), starts.end(), [](const auto& a, const auto& b) { return a.cost < b.cost; });
  Tried best;
  for (Tried& start : starts) {
    if (!std::isfinite(start.cost)) continue;
    polish(start, {1.0, 0.5, 0.25});
    if (start.cost < best.cost) best = std::move(start);
  }
  polish(best, {0.125, 0.0625});
  FoundProfile found{{"designed", limits.start_degc, {}}, best.cost, evaluations};
  if (!best.visits.empty()) found.profile = profile_of(best.visits, limits);
  return found;
}

}  // namespace prism::design
