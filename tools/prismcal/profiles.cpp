// SPDX-License-Identifier: MIT
#include "tools/prismcal/profiles.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "base/escape.hpp"
#include "compensation/features.hpp"
#include "tools/prismcal/units.hpp"
#include "tools/prismsim/simulation/random_source.hpp"

namespace prism::design {
namespace {

constexpr double kHour_s = 3600, kMinute_s = 60;

/// A ramp to each temperature at this rate, then a soak there: degC and s.
simulation::ChamberProfile visiting(const char* name, const ChamberLimits& limits, double degc_per_min,
                                    const std::vector<std::pair<double, double>>& stops) {
  simulation::ChamberProfile profile{name, limits.start_degc, {}};
  double from = limits.start_degc;
  for (const auto& [degc, soak_s] : stops) {
    if (from != degc) profile.segments.push_back({std::abs(degc - from) / degc_per_min * kMinute_s, degc});
    if (soak_s > 0) profile.segments.push_back({soak_s, degc});
    from = degc;
  }
  return profile;
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

/// `count` visits of both ends, or of temperatures within `reach` of them, ramps at a share `speed` of the fastest.
/// `early`: share of the soaks; 0: all at the end, 1: all before.
Visits family_member(const ChamberLimits& limits, double total_min, std::size_t count, bool cold_first, double speed,
                     double reach, double early) {
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
}

}  // namespace

Result<std::vector<InputRange>> parse_domain(const std::string& text) {
  constexpr std::size_t kMostChars = 64;
  constexpr double kColdest_degc = -200, kHottest_degc = 300;  // a gyro that meets others has a wrong unit
  constexpr const char* kWhere = "--domain";
  std::vector<InputRange> ranges;
  for (const std::string& part : tables::list_items(text)) {
    std::array<char, kMostChars> name{}, unit{};
    double low = 0, high = 0;
    int end = 0, read = 0;
    if (part.size() < kMostChars)
      read = std::sscanf(part.c_str(), "%[^=< ] =%lf:%lf%n%s%n", name.data(), &low, &high, &end, unit.data(), &end);
    const std::string input = name.data(), stated = unit.data();
    if (read < 3 || part.find_first_not_of(' ', static_cast<std::size_t>(end)) != std::string::npos ||
        !std::isfinite(low) || !std::isfinite(high))
      return make_error(kWhere, fmt::format("found \"{}\", expected NAME=LOW:HIGH, for example \"T=-40:60, dTdt=-1:1 "
                                            "degC/min\"",
                                            shortened(part)));
    const auto wrong = [&](const std::string& what) {
      return make_error(kWhere, shortened(input) + ": found " + what);
    };
    if (!(low < high)) return wrong(fmt::format("{}:{}, expected the lower limit first", low, high));
    const bool is_slope = compensation::is_slope(input), is_t = input == compensation::kInputTemperature;
    if (is_slope && stated != "degC/min" && stated != "degC/s")
      return wrong(fmt::format("unit \"{}\", expected degC/min or degC/s", shortened(stated)));
    if (is_t && !stated.empty() && stated != "degC")
      return wrong(fmt::format("unit \"{}\", expected degC", shortened(stated)));
    if (is_t && (low < kColdest_degc || high > kHottest_degc))
      return wrong(fmt::format("{}:{}, expected limits within {} to {} degC", low, high, kColdest_degc, kHottest_degc));
    if (std::ranges::count(ranges, input, &InputRange::input) > 0)
      return make_error(kWhere, fmt::format("found {} twice, expected it once", shortened(input)));
    const double factor = is_slope && stated == "degC/min" ? 1 / kMinute_s : 1;
    ranges.push_back({input, low * factor, high * factor});
  }
  return ranges;
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

std::vector<simulation::ChamberProfile> usual_profiles(const ChamberLimits& limits, double hours) {
  const double start = limits.start_degc, low = limits.low_degc, high = limits.high_degc;
  const double fastest = limits.rate_degc_per_min, total_s = hours * kHour_s, path = start - low + high - low;
  const double soaks_s = std::max(0.0, total_s - path / fastest * kMinute_s);
  constexpr int kSteps = 6;
  std::vector<std::pair<double, double>> stairs;
  for (int k = 0; k < kSteps; ++k)
    stairs.emplace_back(low + static_cast<double>(k) / (kSteps - 1) * (high - low), soaks_s / kSteps);
  return {visiting("the paper's cycle", limits, std::min(1.0, fastest),
                   {{start, 2 * kHour_s},
                    {std::max(-40.0, low), 6 * kHour_s},
                    {std::min(70.0, high), 10 * kHour_s},
                    {start, 4 * kHour_s}}),
          visiting("slow ramp", limits, std::min(fastest, path / (total_s / kMinute_s)), {{low, 0}, {high, 0}}),
          visiting("fast ramp", limits, fastest, {{low, soaks_s / 2}, {high, soaks_s / 2}}),
          visiting("staircase", limits, fastest, stairs)};
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
  // Changes one temperature (by 16 degC times the step), or moves time from one part to another (48 min), while that
  // helps.
  const auto part = [](Visits& visits, std::size_t i) -> double& {
    return i % 2 ? visits[i / 2].soak_min : visits[i / 2].ramp_min;
  };
  const auto polish = [&](Tried& best, std::initializer_list<double> steps) {
    for (const double step : steps) {
      bool better = true;
      for (int round = 0; better && round < 3; ++round) {
        better = false;
        for (std::size_t i = 0; i < best.visits.size(); ++i) {
          Visits colder = best.visits, warmer = best.visits;
          colder[i].degc -= 16 * step;
          warmer[i].degc += 16 * step;
          better |= improve(best, colder) || improve(best, warmer);
        }
        for (std::size_t from = 0; from < 2 * best.visits.size(); ++from) {
          for (std::size_t to = 0; to < 2 * best.visits.size(); ++to) {
            Visits changed = best.visits;
            const double taken = std::min(48 * step, part(changed, from));
            if (from == to || taken < kGrid_min) continue;
            part(changed, from) -= taken;
            part(changed, to) += taken;
            better |= improve(best, changed);
          }
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
            improve(starts[count - 1], family_member(limits, total_min, count, cold_first, speed, reach, early));
        }
      }
    }
  }
  std::ranges::stable_sort(starts, {}, &Tried::cost);
  Tried best;
  for (Tried& start : starts) {
    if (!std::isfinite(start.cost)) continue;
    polish(start, {1.0, 0.5, 0.25});
    if (start.cost < best.cost) best = std::move(start);
  }
  polish(best, {0.125, 0.0625});
  return {profile_of(best.visits, limits), best.cost};
}

// Inputs on a profile.

namespace {

constexpr double kSlowTime_s = 4 * 3600;  // of the heat deep in the gyro, which other inputs follow
constexpr double kStep_s = 10;
constexpr std::uint64_t kSeed = 1;

/// -1: not among them.
Eigen::Index place_of(const std::vector<std::string>& names, const std::string& name) {
  const auto at = std::ranges::find(names, name);
  return at == names.end() ? -1 : at - names.begin();
}

// T minus its exponential mean over kSlowTime_s, at each row.
Eigen::VectorXd slow_part(const Eigen::VectorXd& t, const Eigen::VectorXd& time_h) {
  Eigen::VectorXd slow(t.size());
  double mean = t[0];
  for (Eigen::Index i = 0; i < t.size(); ++i) {
    if (i > 0) mean -= (t[i] - mean) * std::expm1(-(time_h[i] - time_h[i - 1]) * 3600 / kSlowTime_s);
    slow[i] = t[i] - mean;
  }
  return slow;
}

// Halton's sequence in the i-th prime base: an even cover of the unit cube.
double halton(int index, std::size_t dimension) {
  constexpr int kPrimes[] = {2, 3, 5, 7, 11, 13, 17, 19, 23, 29};
  const int base = kPrimes[dimension % std::size(kPrimes)];
  double value = 0, share = 1;
  for (; index > 0; index /= base) {
    share /= base;
    value += share * (index % base);
  }
  return value;
}

}  // namespace

void append_columns(Eigen::MatrixXd& all, const Eigen::MatrixXd& more) {
  const Eigen::Index before = all.cols();
  all.conservativeResize(more.rows(), before + more.cols());
  all.rightCols(more.cols()) = more;
}

Result<GyroInputs> GyroInputs::make(std::vector<std::string> names, const compensation::FeatureDefinition& features,
                                    const ThermalResponse& response, const std::vector<RecordedInputs>& recorded) {
  GyroInputs made;
  made.names_ = std::move(names);
  made.features_ = features;
  made.response_ = response;
  made.lines_.resize(made.names_.size());
  const Eigen::Index t = place_of(made.names_, compensation::kInputTemperature),
                     slope = place_of(made.names_, compensation::kInputSlope);
  if (t < 0) return make_error("inputs", fmt::format("found {}, expected T among them", fmt::join(made.names_, ", ")));
  Eigen::MatrixXd values;  // of all recordings
  Eigen::MatrixX4d terms;
  for (const RecordedInputs& r : recorded) {
    const Eigen::VectorXd temperature = r.inputs.row(t);
    append_columns(values, r.inputs);
    Eigen::MatrixX4d part = Eigen::MatrixX4d::Zero(r.inputs.cols(), 4);
    part.col(0).setOnes();
    part.col(1) = temperature;
    if (slope >= 0) part.col(2) = r.inputs.row(slope).transpose();
    part.col(3) = slow_part(temperature, r.time_h);
    terms.conservativeResize(values.cols(), 4);
    terms.bottomRows(part.rows()) = part;
  }
  for (std::size_t j = 0; j < made.names_.size(); ++j) {
    if (static_cast<Eigen::Index>(j) == t || static_cast<Eigen::Index>(j) == slope) continue;
    if (recorded.empty())
      return make_error("inputs", fmt::format("{} does not follow from the chamber's temperature: design needs a model "
                                              "with its recordings, or --prior",
                                              made.names_[j]));
    Line& line = made.lines_[j];
    const Eigen::VectorXd value = values.row(static_cast<Eigen::Index>(j)).transpose();
    line.slope = terms.completeOrthogonalDecomposition().solve(value);
    const Eigen::VectorXd left = value - terms * line.slope;
    const Eigen::Index rows = left.size();
    line.sd = std::sqrt(left.squaredNorm() / static_cast<double>(rows));
    if (line.sd > 0)
      line.kept = std::clamp(left.head(rows - 1).dot(left.tail(rows - 1)) / left.squaredNorm(), 0.0, 0.999);
  }
  return made;
}

Eigen::VectorXd GyroInputs::row(double t_degc, double slope_degc_per_s, double slow_degc,
                                const std::vector<double>& noise) const {
  Eigen::VectorXd x(static_cast<Eigen::Index>(names_.size()));
  for (std::size_t j = 0; j < names_.size(); ++j) {
    double& value = x[static_cast<Eigen::Index>(j)];
    if (names_[j] == compensation::kInputTemperature) {
      value = t_degc;
    } else if (names_[j] == compensation::kInputSlope) {
      value = slope_degc_per_s;
    } else {
      value = lines_[j].slope.dot(Eigen::Vector4d(1, t_degc, slope_degc_per_s, slow_degc)) + lines_[j].sd * noise[j];
    }
  }
  return x;
}

RecordedInputs GyroInputs::on(const simulation::ChamberProfile& profile, int windows) const {
  const double window_s = features_.length_s, row_s = window_s * windows;
  const double share = response_.lag_s > 0 ? -std::expm1(-kStep_s / response_.lag_s) : 1;
  double body = profile.start_degc + (response_.lag_s > 0 ? 0 : response_.self_heating_degc), slow = body;
  std::vector<double> before{body};  // temperatures of the last window
  std::vector<simulation::RandomSource> random;
  std::vector<double> noise;
  for (std::size_t j = 0; j < names_.size(); ++j) noise.push_back(random.emplace_back(kSeed, j).normal());
  RecordedInputs recorded;
  std::vector<Eigen::VectorXd> rows;
  std::vector<double> time_h;
  double next_s = row_s;
  const auto back = static_cast<std::size_t>(std::max(1.0, std::round(window_s / kStep_s)));
  for (double time_s = kStep_s; time_s <= profile.duration_s() + 1e-6; time_s += kStep_s) {
    body += (profile.temperature_degc(time_s - kStep_s / 2) + response_.self_heating_degc - body) * share;
    slow -= (body - slow) * std::expm1(-kStep_s / kSlowTime_s);
    before.push_back(body);
    if (time_s + 1e-6 < next_s) continue;
    next_s += row_s;
    const std::size_t count = std::min(back, before.size() - 1);
    const double from = before[before.size() - 1 - count];
    for (std::size_t j = 0; j < noise.size(); ++j) {
      const double kept = std::pow(lines_[j].kept, windows);
      noise[j] = kept * noise[j] + std::sqrt(1 - kept * kept) * random[j].normal();
    }
    rows.push_back(row((body + from) / 2, (body - from) / (static_cast<double>(count) * kStep_s), body - slow, noise));
    time_h.push_back(time_s / 3600);
  }
  recorded.inputs.resize(static_cast<Eigen::Index>(names_.size()), static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) recorded.inputs.col(static_cast<Eigen::Index>(i)) = rows[i];
  recorded.time_h = Eigen::Map<const Eigen::VectorXd>(time_h.data(), static_cast<Eigen::Index>(time_h.size()));
  return recorded;
}

Result<Eigen::MatrixXd> GyroInputs::over(const std::vector<InputRange>& domain, int count) const {
  for (const InputRange& range : domain) {
    if (place_of(names_, range.input) < 0)
      return make_error(
          "--domain", fmt::format("found {}, expected inputs of the model: {}", range.input, fmt::join(names_, ", ")));
  }
  const auto range_of = [&](const char* name) {
    return std::ranges::find_if(domain, [&](const InputRange& r) { return r.input == name; });
  };
  const auto t = range_of(compensation::kInputTemperature), slope = range_of(compensation::kInputSlope);
  if (t == domain.end()) return make_error("--domain", "found no range of T, expected one");
  Eigen::MatrixXd points(static_cast<Eigen::Index>(names_.size()), count);
  simulation::RandomSource random(kSeed, names_.size());
  for (int i = 0; i < count; ++i) {
    const auto within = [&](const InputRange& r) {
      return r.low + (r.high - r.low) * halton(i + 1, static_cast<std::size_t>(place_of(names_, r.input)));
    };
    std::vector<double> noise(names_.size());
    for (double& value : noise) value = random.normal();
    points.col(i) = row(within(*t), slope == domain.end() ? 0 : within(*slope), 0, noise);
    for (const InputRange& range : domain) points(place_of(names_, range.input), i) = within(range);
  }
  return points;
}

}  // namespace prism::design
