// SPDX-License-Identifier: MIT
// Coverage of the intervals of an Allan deviation and of its coefficients, on simulated noises of known strength. Each
// interval should hold the truth in 68.3 % of the series; the bar, for every point and coefficient, is 63 to 74 %.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
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
    {"N, B", [](double v) { return strengths(0, 1, 300 / v, 0, 0); }},
    {"N, weak B", [](double v) { return strengths(0, 1, 30 / v, 0, 0); }},
    {"N, weak K", [](double v) { return strengths(0, 1, 0, 200 / (v * v), 0); }},
    {"N, K", [](double v) { return strengths(0, 1, 0, 3000 / (v * v), 0); }},
    {"N, B, K", [](double v) { return strengths(0, 1, 60 / v, 1e4 / (v * v), 0); }},
    {"N, B, strong K", [](double v) { return strengths(0, 1, 0.02, 3e5 / (v * v), 0); }},
    {"Q, N, B, K, R", [](double v) { return strengths(3, 1, 60 / v, 1000 / (v * v), 3e5 / (v * v * v)); }},
}};

/// Flicker noise; draws two records at once.
class FlickerRecords {
 public:
  explicit FlickerRecords(std::size_t values) : flicker_(values) {}
  std::vector<double> next(test::NormalPairs& normal) {
    if (second_.empty()) {
      auto [first, second] = flicker_.two(normal);
      second_ = std::move(second);
      return std::move(first);
    }
    return std::exchange(second_, {});
  }

 private:
  test::Flicker flicker_;
  std::vector<double> second_;
};

std::vector<double> simulate(const NoiseSquares& truth, FlickerRecords& flicker, std::size_t values,
                             test::NormalPairs& normal) {
  std::vector<double> rate(values);
  const auto add = [&](double square, const std::vector<double>& part) {
    for (std::size_t i = 0; i < values; ++i) rate[i] += std::sqrt(square) * part[i];
  };
  if (truth(0) > 0) add(truth(0), test::quantised_angle(values, normal));
  if (truth(1) > 0) {
    for (double& value : rate) value += std::sqrt(truth(1)) * normal();
  }
  if (truth(2) > 0) add(truth(2), flicker.next(normal));
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

/// Cells, and how many are outside the bar.
struct Judgement {
  int cells = 0, outside = 0, not_chance = 0;
  double expected = 0, variance = 0;  ///< outside, if all intervals were exact

  std::string operator()(const Count& count) {
    const double share = count.share(), edge = share < kLow ? kLow : kHigh, n = count.all;
    const bool bad = share < kLow || share > kHigh,
               sure = bad && std::abs(share - edge) > 2 * std::sqrt(edge * (1 - edge) / n);
    const boost::math::binomial exact(n, kProbability);
    const double above = std::floor(kHigh * n + 1e-9), below = std::ceil(kLow * n - 1e-9) - 1;
    const double by_chance =
        (below >= 0 ? boost::math::cdf(exact, below) : 0) + boost::math::cdf(boost::math::complement(exact, above));
    ++cells;
    outside += bad;
    not_chance += sure;
    expected += by_chance;
    variance += by_chance * (1 - by_chance);
    return fmt::format("{:.1f}{}", 100 * share, sure ? "!!" : bad ? "!" : "");
  }
};

/// The quantities of one process, with the number of series that gave and covered each.
struct Tally {
  std::vector<Count> points;
  std::array<Count, kNoiseTypes> coefficients;
  std::array<int, kNoiseTypes> determined{};
};

void count_series(Tally& tally, const std::vector<double>& rate, const std::vector<std::size_t>& sizes,
                  const NoiseSquares& truth, double slack) {
  const AllanCurve curve = allan_deviation(rate, 1, sizes, AllanEstimator::kOverlapping, "bench").value();
  const AllanModel model = AllanModel::fit(curve, "bench").value();
  const auto holds = [&](double low, double value, double high) {
    return low * (1 - slack) <= value && value <= high * (1 + slack);
  };
  const auto intervals = allan_confidence(curve, model, kProbability);
  for (std::size_t k = 0; k < curve.points.size(); ++k) {
    if (!intervals[k].determined) continue;
    const auto at = static_cast<std::size_t>(std::find(sizes.begin(), sizes.end(), curve.points[k].m) - sizes.begin());
    const double deviation = std::sqrt(unit_variances(static_cast<double>(curve.points[k].m)).dot(truth));
    tally.points[at].add(holds(intervals[k].low, deviation, intervals[k].high));
  }
  const AllanCoefficients found = extract_coefficients(curve, model, kProbability, "bench").value();
  const std::array<bool, kNoiseTypes> determined = {
      found.quantisation_arcsec.has_value(), found.angle_random_walk_deg_per_sqrt_h.has_value(),
      found.bias_instability_deg_per_h.has_value(), found.rate_random_walk_deg_per_h_sqrt_h.has_value(),
      found.rate_ramp_deg_per_h_h.has_value()};
  constexpr double h = 3600;
  const std::array<double, kNoiseTypes> scale = {1, std::sqrt(1 / h), 1 / kAllanFlicker, std::sqrt(h), h};
  for (std::size_t k = 0; k < kNoiseTypes; ++k) {
    tally.determined[k] += determined[k];
    const bool ramp = k + 1 == kNoiseTypes;
    if (ramp && !determined[k]) continue;  // the only one that may have no interval
    const double value = std::sqrt(truth(static_cast<Eigen::Index>(k))) * scale[k];
    tally.coefficients[k].add(holds(found.at_least[k], value, found.at_most[k]));
  }
}

/// Prints one line of points and one of coefficients.
void run(const Process& process, std::size_t number, std::size_t values, int series, double lost, std::uint64_t seed,
         Judgement& judged) {
  const NoiseSquares truth = process.strengths(static_cast<double>(values));
  FlickerRecords flicker(truth(2) > 0 ? values : 2);
  const auto sizes = allan_cluster_sizes(AllanGrid::kOctave, values);
  // The interval of a ramp without noise has the width of the rounding.
  const bool exact = !(truth.head(kNoiseTypes - 1).array() > 0).any();
  Tally tally{std::vector<Count>(sizes.size()), {}, {}};
  test::NormalPairs normal(seed * 1'000'003 + number * 1009 + values);
  for (int i = 0; i < series; ++i) {
    std::vector<double> rate = simulate(truth, flicker, values, normal);
    if (lost > 0) {
      for (double& value : rate) {
        if (normal.uniform() < lost) value = std::nan("");
      }
    }
    count_series(tally, rate, sizes, truth, exact ? 1e-9 : 0);
  }
  const auto text = [&](const Count& count) {
    std::string share = exact && count.share() == 1 ? std::string("exact") : judged(count);
    return count.all < series ? fmt::format("{} in {} series", share, count.all) : share;
  };
  fmt::print("{:<16}{:>7} values, points:", process.name, values);
  for (const Count& point : tally.points) fmt::print(" {}", point.all > 0 ? text(point) : "not determined");
  fmt::print("\n{:<31}coefficients:", "");
  for (std::size_t k = 0; k < kNoiseTypes; ++k) {
    const Count& count = tally.coefficients[k];
    if (count.all == 0) continue;
    fmt::print(" {}{} {}", kLetters[k], truth(static_cast<Eigen::Index>(k)) > 0 ? "" : "=0", text(count));
    fmt::print(" (value in {:.0f} %);", 100.0 * tally.determined[k] / series);
  }
  fmt::print("\n");
  std::fflush(stdout);
}

}  // namespace
}  // namespace prism::bench

/// Arguments: series per process (1000), share of lost values (0), seed (1), values (1000 8000 100000), processes
/// (all).
int main(int argc, char** argv) {
  const int series = argc > 1 ? std::atoi(argv[1]) : 1000;
  const double lost = argc > 2 ? std::atof(argv[2]) : 0;
  const std::uint64_t seed = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1;
  std::vector<std::size_t> lengths = {1000, 8000, 100000}, processes;
  if (argc > 4) lengths = {static_cast<std::size_t>(std::atoll(argv[4]))};
  for (int i = 5; i < argc; ++i) processes.push_back(static_cast<std::size_t>(std::atoll(argv[i])));
  fmt::print(
      "Intervals of 68.3 %: share that holds the truth, in % of {} series; one standard deviation is {:.1f} %\n"
      "! outside 63 to 74; !! by more than two standard deviations\n",
      series, 100 * std::sqrt(0.683 * 0.317 / series));
  prism::bench::Judgement judged;
  for (const std::size_t values : lengths) {
    for (std::size_t k = 0; k < prism::bench::kProcesses.size(); ++k) {
      if (!processes.empty() && std::find(processes.begin(), processes.end(), k) == processes.end()) continue;
      prism::bench::run(prism::bench::kProcesses[k], k, values, series, lost, seed, judged);
    }
  }
  fmt::print(
      "{} of {} cells outside the bar, {} by more than two standard deviations; chance puts {:.1f} +- {:.1f} of "
      "exact intervals outside\n",
      judged.outside, judged.cells, judged.not_chance, judged.expected, std::sqrt(judged.variance));
  return judged.outside > 0;
}
