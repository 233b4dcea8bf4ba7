// SPDX-License-Identifier: MIT
#include "compensation/evaluation/allan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "base/plain_text.hpp"
#include "compensation/evaluation/allan_fit.hpp"

namespace prism::evaluation {
namespace {

constexpr std::size_t kFewestClusters = 8;  // the longest averaging time is an eighth of the series
constexpr double kLeastEdf = 2, kMissSigma = 4;

struct Record {
  std::size_t begin = 0, end = 0;  ///< the first and the last value are not missing
  std::size_t size() const { return end - begin; }
};

/// The running sum of a series, relative to the line through its first and last third; a missing value is on the line.
struct Phase {
  explicit Phase(std::vector<double> rate);

  /// The sum before rate i; i: at most the number of rates.
  double before(std::size_t i) const { return i > 0 ? x[i - 1] : 0; }

  std::vector<double> x;            ///< the sum after each rate
  std::vector<std::uint32_t> lost;  ///< number of missing values before each rate and after the last, if there are any
  std::vector<Record> records;
  std::size_t values = 0, missing = 0, holes = 0, size = 0;  ///< size: of all records, with their missing values
  double slope = 0;                                          ///< per sample
};

Phase::Phase(std::vector<double> rate) : x(std::move(rate)) {
  Record open;
  for (std::size_t i = 0; i <= x.size(); ++i) {
    if (i == x.size() || std::isinf(x[i])) {
      if (open.end > 0) records.push_back(std::exchange(open, {}));
    } else if (std::isfinite(x[i])) {
      if (open.end == 0) open.begin = i;
      open.end = i + 1;
      ++values;
    } else {
      ++missing;
    }
    holes += i < x.size() && !std::isfinite(x[i]) && (i == 0 || std::isfinite(x[i - 1]));
  }
  Record longest;
  for (const Record& record : records) {
    size += record.size();
    if (record.size() > longest.size()) longest = record;
  }
  // Of the rates that are there, and of their positions.
  const auto mean = [&](std::size_t begin, std::size_t end) {
    double sum = 0, positions = 0, count = 0;
    for (std::size_t i = begin; i < end; ++i) {
      if (std::isfinite(x[i])) sum += x[i], positions += static_cast<double>(i), ++count;
    }
    return std::pair(sum / count, positions / count);
  };
  if (const std::size_t third = longest.size() / 3; third > 0) {
    const auto [first, first_at] = mean(longest.begin, longest.begin + third);
    const auto [last, last_at] = mean(longest.end - third, longest.end);
    slope = (last - first) / (last_at - first_at);
  }
  const auto [level, centre] = mean(0, x.size());
  if (missing > 0) lost.push_back(0);
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const bool known = std::isfinite(x[i]);
    const double value = known ? x[i] - level - slope * (static_cast<double>(i) - centre) : 0;
    if (missing > 0) lost.push_back(lost.back() + !known);
    x[i] = sum += value;
  }
}

/// m: at most half of the size.
AllanVariance variance_at(const Phase& phase, std::size_t m) {
  const double size = static_cast<double>(m), rise = phase.slope * size * size;
  AllanVariance found{.m = m};
  for (const Record& record : phase.records) {
    for (std::size_t i = record.begin; i + 2 * m <= record.end; ++i) {
      const double middle = phase.before(i + m);
      const double first = middle - phase.before(i), second = phase.before(i + 2 * m) - middle;
      double d = second - first;
      if (!phase.lost.empty()) {
        const double a = size - (phase.lost[i + m] - phase.lost[i]),
                     b = size - (phase.lost[i + 2 * m] - phase.lost[i + m]);
        if (20 * std::min(a, b) < 19 * size) continue;
        if (a + b < 2 * size) d = (second / b - first / a) * size * std::sqrt(2 / (size / a + size / b));
      }
      found.flat += d * d;
      found.raw += (d + rise) * (d + rise);
      ++found.windows;
    }
  }
  const double windows = static_cast<double>(found.windows), divisor = 2 * size * size * std::max(windows, 1.0);
  found.flat /= divisor;
  found.raw /= divisor;
  found.share = windows / static_cast<double>(phase.size - 2 * m + 1);
  return found;
}

/// The variances that have enough pairs of clusters, of octaves.
std::vector<AllanVariance> measure(const Phase& phase) {
  std::vector<AllanVariance> all;
  for (std::size_t m = 1; m <= phase.size / kFewestClusters; m *= 2) {
    const AllanVariance found = variance_at(phase, m);
    if (found.share * allan_edf(phase.size, m, {0, 0, 0, 1}) >= kLeastEdf) all.push_back(found);
  }
  return all;
}

/// From strengths per sample to the units of AllanCoefficients.
AllanCoefficients in_units(AllanCoefficients all, double tau0_s) {
  const double h = tau0_s / 3600;
  const double unit[] = {tau0_s, std::sqrt(h), 1 / std::sqrt(kFlicker), 1 / std::sqrt(h), 1 / h};
  for (std::size_t k = 0; k < kNoiseTypes; ++k) {
    const auto scaled = [&](double strength) {
      return unit[k] * (k < kNoiseTypes - 1 ? std::sqrt(strength) : strength);
    };
    all[k] = {all[k].value ? std::optional(scaled(*all[k].value)) : std::nullopt, scaled(all[k].low),
              scaled(all[k].high)};
  }
  return all;
}

/// A ramp has no part in the width of a point's interval.
AllanPoint point_of(const AllanVariance& found, const Phase& phase, double tau0_s, const NoiseStrengths& noise,
                    bool ramp) {
  const double size = static_cast<double>(found.m), rise = ramp ? phase.slope * size : 0;
  const double random = ramp ? found.flat : found.raw, fixed = found.raw - random;
  AllanPoint point{.m = found.m, .tau_s = size * tau0_s, .deviation = std::sqrt(found.raw), .windows = found.windows};
  point.edf = found.share * allan_edf(phase.size, found.m, noise);
  // Quantiles of a chi-square of ±1 standard deviation (Wilson and Hilferty 1931).
  const auto limit = [&](double z) {
    const double a = 2 / (9 * point.edf);
    return std::sqrt(fixed + random / std::pow(std::max(1 - a + z * std::sqrt(a), 0.1), 3));
  };
  point.low = limit(1);
  point.high = limit(-1);
  const double parts[] = {3 * noise[0] / (size * size), noise[1] / size, noise[2], noise[3] * size / 3,
                          rise * rise / 2};
  point.noise = static_cast<NoiseType>(std::max_element(std::begin(parts), std::end(parts)) - std::begin(parts));
  return point;
}

}  // namespace

const char* noise_type_text(NoiseType type) {
  static constexpr const char* kTexts[] = {"quantisation", "angle random walk", "bias instability", "rate random walk",
                                           "rate ramp"};
  return kTexts[static_cast<std::size_t>(type)];
}

const AllanPoint& AllanAnalysis::minimum() const {
  return *std::min_element(points.begin(), points.end(),
                           [](const AllanPoint& a, const AllanPoint& b) { return a.deviation < b.deviation; });
}

Result<AllanAnalysis> analyse_allan(std::vector<double> rate, double tau0_s, const std::string& where) {
  if (!(tau0_s > 0) || !std::isfinite(tau0_s))
    return make_error(where, fmt::format("found a sample interval of {} s, expected a positive number", tau0_s));
  const Phase phase(std::move(rate));
  const std::vector<AllanVariance> octaves = measure(phase);
  if (octaves.empty()) {
    return make_error(where, fmt::format("found {} values with {} gaps, expected at least {} without a gap",
                                         phase.values, phase.holes, kFewestClusters));
  }
  double raw = 0, flat = 0;  // the largest
  for (const AllanVariance& each : octaves) {
    raw = std::max(raw, each.raw);
    flat = std::max(flat, each.flat);
  }
  if (!(raw > 0) || !std::isfinite(raw))
    return make_error(where, fmt::format("found an Allan deviation of {}, expected a rate that varies", raw));

  AllanAnalysis result;
  result.tau0_s = tau0_s;
  result.values = phase.values;
  result.missing = phase.missing;
  result.holes = phase.holes;
  AllanFit fit;
  fit.noise[1] = raw;  // white noise, for the intervals of the points
  if (octaves.size() < 3) {
    result.coefficients =
        make_error(where, fmt::format("found {}, expected 3 or more: 32 values", counted(octaves.size(), "octave")));
  } else if (flat < 1e-20 * raw) {
    result.coefficients = make_error(where, "the rate is a straight line, without noise");
  } else {
    fit = fit_allan(phase.size, phase.slope, octaves);
    result.coefficients = in_units(fit.strengths, tau0_s);
    for (std::size_t i = 0; i < octaves.size(); ++i) {
      if (std::abs(fit.misses[i]) > kMissSigma)
        result.unexplained_s.push_back(static_cast<double>(octaves[i].m) * tau0_s);
    }
  }
  for (const AllanVariance& found : octaves)
    result.points.push_back(
        point_of(found, phase, tau0_s, fit.noise, coefficient(fit.strengths, NoiseType::kRateRamp).value.has_value()));
  return result;
}

double allan_deviation(std::vector<double> rate, std::size_t m) {
  return std::sqrt(variance_at(Phase(std::move(rate)), m).raw);
}

}  // namespace prism::evaluation
