// SPDX-License-Identifier: MIT
#include "compensation/evaluation/allan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "compensation/evaluation/statistics.hpp"

namespace prism::evaluation {
namespace {

/// One segment without a gap, as the running sum x of its values: x[0] = 0, x[n] = y_0 + … + y_{n−1}.
using Phase = std::vector<double>;

struct PhaseRuns {
  std::vector<Phase> runs;
  std::size_t values = 0, holes = 0;
};

/// The Allan deviation does not depend on a constant, so the mean is subtracted first: the sums stay small and precise.
PhaseRuns integrate(std::span<const double> rate) {
  PhaseRuns result;
  double origin = 0, offsets = 0;
  for (const double value : rate) {
    if (!std::isfinite(value)) {
      ++result.holes;
      continue;
    }
    if (result.values++ == 0) origin = value;
    offsets += value - origin;
  }
  if (result.values == 0) return result;
  const double mean = origin + offsets / static_cast<double>(result.values);
  for (std::size_t i = 0; i < rate.size();) {
    if (!std::isfinite(rate[i])) {
      ++i;
      continue;
    }
    std::size_t end = i;
    while (end < rate.size() && std::isfinite(rate[end])) ++end;
    Phase phase;
    phase.reserve(end - i + 1);
    double x = 0;
    phase.push_back(0);
    for (; i < end; ++i) phase.push_back(x += rate[i] - mean);
    result.runs.push_back(std::move(phase));
  }
  return result;
}

/// Σ over j of the squared second difference with stride m; four partial sums for instruction-level parallelism.
double squared_second_differences(const Phase& x, std::size_t m, std::size_t first, std::size_t step,
                                  std::size_t terms) {
  double sums[4] = {0, 0, 0, 0};
  const double* at = x.data() + first;
  std::size_t k = 0;
  for (; k + 4 <= terms; k += 4) {
    for (std::size_t lane = 0; lane < 4; ++lane) {
      const double* p = at + (k + lane) * step;
      const double d = p[2 * m] - 2 * p[m] + p[0];
      sums[lane] += d * d;
    }
  }
  for (; k < terms; ++k) {
    const double* p = at + k * step;
    const double d = p[2 * m] - 2 * p[m] + p[0];
    sums[0] += d * d;
  }
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

AllanPoint measure(const PhaseRuns& phases, std::size_t m, double tau0_s, AllanEstimator estimator) {
  AllanPoint point{m, static_cast<double>(m) * tau0_s, 0, 0, 0};
  double squares = 0;
  for (const Phase& x : phases.runs) {
    const std::size_t values = x.size() - 1;
    point.clusters += values / m;
    if (values / m < 2) continue;
    const bool overlapping = estimator == AllanEstimator::kOverlapping;
    const std::size_t terms = overlapping ? values - 2 * m + 1 : values / m - 1;
    squares += squared_second_differences(x, m, 0, overlapping ? 1 : m, terms);
    point.terms += terms;
  }
  if (point.terms > 0) {
    point.deviation = std::sqrt(squares / (2.0 * static_cast<double>(point.terms))) / static_cast<double>(m);
  }
  return point;
}

}  // namespace

std::vector<std::size_t> allan_cluster_sizes(AllanGrid grid, std::size_t values) {
  const std::size_t largest = values / 3;
  std::vector<std::size_t> sizes;
  if (grid == AllanGrid::kOctave) {
    for (std::size_t m = 1; m <= largest; m *= 2) sizes.push_back(m);
  } else if (grid == AllanGrid::kDecade) {
    for (std::size_t decade = 1; decade <= largest; decade *= 10) {
      for (const std::size_t digit : {1, 2, 4}) {
        if (digit * decade <= largest) sizes.push_back(digit * decade);
      }
    }
  } else {
    for (int k = 0;; ++k) {
      const auto m = static_cast<std::size_t>(std::llround(std::pow(10.0, k / 15.0)));
      if (m > largest) break;
      if (sizes.empty() || m > sizes.back()) sizes.push_back(m);
    }
  }
  return sizes;
}

Result<AllanCurve> allan_deviation(std::span<const double> rate, double tau0_s,
                                   std::span<const std::size_t> cluster_sizes, AllanEstimator estimator,
                                   const std::string& where) {
  if (!(tau0_s > 0) || !std::isfinite(tau0_s)) {
    return make_error(where, fmt::format("found a sample interval of {} s, expected a positive number", tau0_s));
  }
  const PhaseRuns phases = integrate(rate);
  AllanCurve curve{estimator, tau0_s, phases.values, phases.holes, phases.runs.size(), {}};
  const bool enough = std::any_of(phases.runs.begin(), phases.runs.end(), [](const Phase& x) { return x.size() > 3; });
  if (!enough) {
    return make_error(where,
                      fmt::format("found {} values in {} segments without a gap, expected at least 3 in one segment",
                                  phases.values, phases.runs.size()));
  }
  for (const std::size_t m : cluster_sizes) {
    if (m == 0) return make_error(where, "found a cluster of 0 samples, expected 1 or more");
    const AllanPoint point = measure(phases, m, tau0_s, estimator);
    if (point.terms > 0) curve.points.push_back(point);
  }
  return curve;
}

}  // namespace prism::evaluation
