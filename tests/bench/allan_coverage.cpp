// SPDX-License-Identifier: MIT
// Coverage of the intervals of an Allan deviation and of its coefficients, on simulated noises of known strength. Each
// interval should hold the truth in 68.3 % of the series; the bar is 63 to 74 %.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "compensation/evaluation/allan_coefficients.hpp"
#include "tests/support/power_law_noise.hpp"

namespace prism::bench {
namespace {

using namespace evaluation;

constexpr double kProbability = 0.683, kLow = 0.63, kHigh = 0.74;
constexpr const char* kLetters = "QNBKR";

/// Strengths per sample (allan_covariance.hpp) of a record of `values`; they may depend on its length.
struct Process {
  const char* name;
  NoiseSquares (*strengths)(double values);
  bool counts = true;  ///< false: noises that a record of this length hardly separates; shown, but not part of the bar
};

NoiseSquares strengths(double q, double n, double b, double k, double r) {
  NoiseSquares squares;
  squares << q, n, b, k, r;
  return squares;
}

constexpr std::array<Process, 15> kProcesses = {{
    {"white", [](double) { return strengths(0, 9, 0, 0, 0); }},
    {"flicker", [](double) { return strengths(0, 0, 1, 0, 0); }},
    {"random walk", [](double) { return strengths(0, 0, 0, 1, 0); }},
    {"quantisation", [](double) { return strengths(1, 0, 0, 0, 0); }},
    {"ramp, N", [](double v) { return strengths(0, 1, 0, 0, 1e4 / (v * v * v)); }},
    {"strong ramp, N", [](double) { return strengths(0, 1, 0, 0, 1); }},
    {"ramp, no noise", [](double) { return strengths(0, 0, 0, 0, 1); }},
    {"Q, N", [](double) { return strengths(1, 0.3, 0, 0, 0); }},
    {"N, B", [](double v) { return strengths(0, 1, 300 / v, 0, 0); }, false},
    {"N, weak B", [](double v) { return strengths(0, 1, 30 / v, 0, 0); }, false},
    {"N, weak K", [](double v) { return strengths(0, 1, 0, 200 / (v * v), 0); }, false},
    {"N, K", [](double v) { return strengths(0, 1, 0, 3000 / (v * v), 0); }, false},
    {"N, B, K", [](double v) { return strengths(0, 1, 60 / v, 1e4 / (v * v), 0); }},
    {"N, B, strong K", [](double v) { return strengths(0, 1, 0.02, 3e5 / (v * v), 0); }},
    {"Q, N, B, K, R", [](double v) { return strengths(3, 1, 60 / v, 1000 / (v * v), 3e5 / (v * v * v)); }, false},
}};

std::vector<double> simulate(const NoiseSquares& truth, const test::Flicker& flicker, std::size_t values,
                             std::uint64_t seed) {
  test::NormalPairs normal(seed);
  std::vector<double> rate(values);
  const auto add = [&](double square, const std::vector<double>& part) {
    for (std::size_t i = 0; i < values; ++i) rate[i] += std::sqrt(square) * part[i];
  };
  if (truth(0) > 0) add(truth(0), test::quantised_angle(values, normal));
  if (truth(1) > 0) {
    for (double& value : rate) value += std::sqrt(truth(1)) * normal();
  }
  if (truth(2) > 0) add(truth(2), flicker(normal));
  if (truth(3) > 0) add(truth(3), test::averaged_walk(values, normal));
  for (std::size_t i = 0; i < values; ++i) rate[i] += std::sqrt(truth(4)) * static_cast<double>(i);
  return rate;
}

struct Count {
  int inside = 0, all = 0;
  void add(bool hit) {
    inside += hit;
    ++all;
  }
  double share() const { return static_cast<double>(inside) / all; }
};

/// At least a third of the series must have the interval: fewer say little of its coverage.
std::string judged(const Count& count, int series, int& outside) {
  const bool bad = 3 * count.all >= series && (count.share() < kLow || count.share() > kHigh);
  outside += bad;
  return fmt::format("{:.1f}{}", 100 * count.share(), bad ? "!" : "");
}

/// Prints one line of points and one of coefficients; returns how many are outside the bar.
int run(const Process& process, std::size_t number, std::size_t values, int series, double lost) {
  const NoiseSquares truth = process.strengths(static_cast<double>(values));
  const test::Flicker flicker(values);
  const auto sizes = allan_cluster_sizes(AllanGrid::kOctave, values);
  std::vector<Count> points(sizes.size());
  std::array<Count, kNoiseTypes> coefficients;
  const bool exact = !(truth.head(kNoiseTypes - 1).array() > 0).any();
  for (int i = 0; i < series; ++i) {
    std::vector<double> rate = simulate(truth, flicker, values, 1'000'003 * number + static_cast<std::uint64_t>(i));
    test::NormalPairs dice(77 + static_cast<std::uint64_t>(i));
    if (lost > 0) {
      for (double& value : rate) {
        if (dice.uniform() < lost) value = std::nan("");
      }
    }
    const AllanCurve curve = allan_deviation(rate, 1, sizes, AllanEstimator::kOverlapping, "bench").value();
    const AllanModel model = AllanModel::fit(curve, "bench").value();
    const auto intervals = allan_confidence(curve, model, kProbability);
    // The interval of a ramp without noise has the width of the rounding.
    const double slack = exact ? 1e-9 : 0;
    for (std::size_t k = 0; k < curve.points.size(); ++k) {
      const auto at =
          static_cast<std::size_t>(std::find(sizes.begin(), sizes.end(), curve.points[k].m) - sizes.begin());
      const double deviation = std::sqrt(unit_variances(static_cast<double>(curve.points[k].m)).dot(truth));
      points[at].add(intervals[k].low * (1 - slack) <= deviation && deviation <= intervals[k].high * (1 + slack));
    }
    const AllanCoefficients found = extract_coefficients(curve, model, kProbability, "bench").value();
    const std::array<const std::optional<AllanCoefficient>*, kNoiseTypes> each = {
        &found.quantisation_arcsec, &found.angle_random_walk_deg_per_sqrt_h, &found.bias_instability_deg_per_h,
        &found.rate_random_walk_deg_per_h_sqrt_h, &found.rate_ramp_deg_per_h_h};
    const double h = 3600;
    const std::array<double, kNoiseTypes> scale = {1, std::sqrt(1 / h), 1 / kAllanFlicker, std::sqrt(h), h};
    for (std::size_t k = 0; k < kNoiseTypes; ++k) {
      if (!*each[k]) continue;
      const double value = std::sqrt(truth(static_cast<Eigen::Index>(k))) * scale[k];
      coefficients[k].add((*each[k])->low * (1 - slack) <= value && value <= (*each[k])->high * (1 + slack));
    }
  }
  int outside = 0;
  fmt::print("{:<16}{:>7} values, points:", process.name, values);
  for (std::size_t k = 0; k < points.size(); ++k)
    fmt::print(" {}", exact && points[k].share() == 1 ? "exact" : judged(points[k], series, outside));
  fmt::print("\n{:<31}coefficients:", "");
  for (std::size_t k = 0; k < kNoiseTypes; ++k) {
    if (coefficients[k].all == 0) continue;
    fmt::print(" {} {} in {} of {};", kLetters[k],
               exact && coefficients[k].share() == 1 ? "exact" : judged(coefficients[k], series, outside),
               coefficients[k].all, series);
  }
  fmt::print("\n");
  std::fflush(stdout);
  return process.counts ? outside : 0;
}

}  // namespace
}  // namespace prism::bench

/// Arguments: series per process (1000), share of lost values (0), process (all), values (1000 8000 100000).
int main(int argc, char** argv) {
  const int series = argc > 1 ? std::atoi(argv[1]) : 1000;
  const double lost = argc > 2 ? std::atof(argv[2]) : 0;
  const int only = argc > 3 ? std::atoi(argv[3]) : -1;
  std::vector<std::size_t> lengths = {1000, 8000, 100000};
  if (argc > 4) lengths = {static_cast<std::size_t>(std::atoll(argv[4]))};
  fmt::print("Intervals of 68.3 %: share that holds the truth, in % of {} series; ! outside 63 to 74\n", series);
  int outside = 0;
  for (const std::size_t values : lengths) {
    for (std::size_t k = 0; k < prism::bench::kProcesses.size(); ++k) {
      if (only >= 0 && static_cast<std::size_t>(only) != k) continue;
      outside += prism::bench::run(prism::bench::kProcesses[k], k, values, series, lost);
    }
  }
  fmt::print("{} outside the bar\n", outside);
  return outside > 0;
}
