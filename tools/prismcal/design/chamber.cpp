// SPDX-License-Identifier: MIT
#include "tools/prismcal/design/chamber.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include "base/escape.hpp"
#include "compensation/features.hpp"

namespace prism::design {
namespace {

constexpr double kHour_s = 3600, kMinute_s = 60;
constexpr double kColdest_degc = -200, kHottest_degc = 300;  // of any chamber
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
  if (limits.low_degc < kColdest_degc || limits.high_degc > kHottest_degc)
    return make_error(kWhere, fmt::format("T: found {}:{}, expected limits within {} to {} degC", limits.low_degc,
                                          limits.high_degc, kColdest_degc, kHottest_degc));
  if (start_degc < limits.low_degc || start_degc > limits.high_degc)
    return make_error("--start", fmt::format("found {} degC, expected {} to {}, the limits of the chamber", start_degc,
                                             limits.low_degc, limits.high_degc));
  return limits;
}

namespace {

// Temperatures that no gyro meets are a wrong unit.
std::optional<Error> implausible(const Statement& s, const char* where) {
  if (s.name != compensation::kInputTemperature) return std::nullopt;
  if (!s.unit.empty() && s.unit != "degC")
    return Error{where, fmt::format("T: found unit \"{}\", expected degC", shortened(s.unit))};
  if (*s.low < kColdest_degc || s.high > kHottest_degc)
    return Error{where, fmt::format("T: found {}:{}, expected limits within {} to {} degC", *s.low, s.high,
                                    kColdest_degc, kHottest_degc)};
  return std::nullopt;
}

}  // namespace

Result<std::vector<InputRange>> parse_domain(const std::string& text) {
  constexpr const char* kWhere = "--domain";
  const auto all = statements_of(text, kWhere, "NAME=LOW:HIGH, for example \"T=-40:60, dTdt=-1:1 degC/min\"");
  if (!all) return tl::unexpected<Error>(all.error());
  std::vector<InputRange> domain;
  for (const Statement& s : *all) {
    if (!s.low)
      return make_error(kWhere,
                        fmt::format("{}: found <=, expected {}=LOW:HIGH", shortened(s.name), shortened(s.name)));
    if (auto error = implausible(s, kWhere)) return tl::unexpected<Error>(std::move(*error));
    double factor = 1;
    if (compensation::is_slope(s.name)) {
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

}  // namespace prism::design
