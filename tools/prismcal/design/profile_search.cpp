// SPDX-License-Identifier: MIT
#include "tools/prismcal/design/profile_search.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace prism::design {
namespace {

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

class Search {
 public:
  Search(const ChamberLimits& limits, double total_min, const ProfileCost& cost, int most)
      : limits_(limits), total_min_(total_min), cost_(cost), most_(most) {}

  struct Tried {
    Visits visits;
    double cost = std::numeric_limits<double>::infinity();
  };

  /// Keeps the candidate if it is possible and better.
  bool improve(Tried& best, const Visits& candidate) {
    if (evaluations_ >= most_) return false;
    const auto visits = possible(candidate, limits_, total_min_);
    if (!visits) return false;
    ++evaluations_;
    const double cost = cost_(profile_of(*visits, limits_));
    if (!(cost < best.cost)) return false;
    best = {*visits, cost};
    return true;
  }

  /// The best of the family with this number of visits.
  Tried family(std::size_t count) {
    Tried best;
    for (const bool cold_first : {true, false}) {
      for (const double speed : {1.0, 0.5, 0.25}) {
        for (const double reach : {1.0, 0.8}) {
          for (const double early : {0.0, 0.5, 1.0}) {  // share of the soaks: 0: all at the end, 1: all before
            Visits visits;
            double from = limits_.start_degc, left = total_min_;
            for (std::size_t i = 0; i < count; ++i) {
              const bool cold = cold_first == (i % 2 == 0);
              const double end = cold ? limits_.low_degc : limits_.high_degc;
              const double degc = std::round(limits_.start_degc + reach * (end - limits_.start_degc));
              visits.push_back({degc, std::abs(degc - from) / limits_.rate_degc_per_min / speed, 0});
              from = degc;
              left -= visits.back().ramp_min;
            }
            for (Visit& v : visits) v.soak_min = std::max(0.0, early * left / static_cast<double>(count));
            improve(best, visits);
          }
        }
      }
    }
    return best;
  }

  /// Changes one temperature (by 16 degC times the step), or moves time from one part to another (48 min), while that
  /// helps.
  void polish(Tried& best, std::initializer_list<double> steps) {
    for (const double step : steps) {
      bool better = true;
      for (int round = 0; better && round < 3; ++round) {
        better = false;
        for (std::size_t i = 0; i < best.visits.size(); ++i) better |= temperatures(best, i, 16 * step);
        for (std::size_t from = 0; from < 2 * best.visits.size(); ++from) {
          for (std::size_t to = 0; to < 2 * best.visits.size(); ++to)
            better |= from != to && moved(best, from, to, 48 * step);
        }
      }
    }
  }

  int evaluations() const { return evaluations_; }

 private:
  bool temperatures(Tried& best, std::size_t i, double step_degc) {
    for (const double sign : {-1.0, 1.0}) {
      Visits changed = best.visits;
      changed[i].degc += sign * step_degc;
      if (improve(best, changed)) return true;
    }
    return false;
  }

  static double& part(Visits& visits, std::size_t i) { return i % 2 ? visits[i / 2].soak_min : visits[i / 2].ramp_min; }

  bool moved(Tried& best, std::size_t from, std::size_t to, double minutes) {
    Visits changed = best.visits;
    const double taken = std::min(minutes, part(changed, from));
    if (taken < kGrid_min) return false;
    part(changed, from) -= taken;
    part(changed, to) += taken;
    return improve(best, changed);
  }

  const ChamberLimits limits_;
  const double total_min_;
  const ProfileCost& cost_;
  const int most_;
  int evaluations_ = 0;
};

}  // namespace

FoundProfile find_profile(const ChamberLimits& limits, double hours, const ProfileCost& cost, int max_evaluations) {
  const double total_min = std::floor(hours * 60 / kGrid_min) * kGrid_min;
  Search search(limits, total_min, cost, max_evaluations);
  Search::Tried best;
  std::vector<Search::Tried> starts;
  for (std::size_t count = 1; count <= kMostVisits; ++count) starts.push_back(search.family(count));
  std::stable_sort(starts.begin(), starts.end(), [](const auto& a, const auto& b) { return a.cost < b.cost; });
  for (Search::Tried& start : starts) {
    if (!std::isfinite(start.cost)) continue;
    search.polish(start, {1.0, 0.5, 0.25});
    if (start.cost < best.cost) best = std::move(start);
  }
  search.polish(best, {0.125, 0.0625});
  FoundProfile found{{"designed", limits.start_degc, {}}, best.cost, search.evaluations()};
  if (!best.visits.empty()) found.profile = profile_of(best.visits, limits);
  return found;
}

}  // namespace prism::design
