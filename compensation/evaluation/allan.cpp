// SPDX-License-Identifier: MIT
#include "compensation/evaluation/allan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <tuple>
#include <utility>

#include "base/plain_text.hpp"
#include "compensation/evaluation/allan_fit.hpp"

namespace prism::evaluation {
namespace {

constexpr std::size_t kFewestClusters = 8;  // the longest averaging time is an eighth of the series
constexpr double kLeastEdf = 2, kMissSigma = 4;

struct Record {
  std::size_t begin = 0, end = 0;  ///< first and last value are not missing
  std::size_t size() const { return end - begin; }
};

/// The running sum of a series, relative to the line through its first and last third; a missing value is on the line.
class Phase {
 public:
  explicit Phase(std::vector<double> rate) : x_(std::move(rate)) {
    find_records();
    find_line();
    if (missing_ > 0) lost_.push_back(0);
    double sum = 0;
    for (std::size_t i = 0; i < x_.size(); ++i) {
      const bool known = std::isfinite(x_[i]);
      const double value = known ? x_[i] - level_ - slope_ * (static_cast<double>(i) - centre_) : 0;
      if (missing_ > 0) lost_.push_back(lost_.back() + !known);
      x_[i] = sum;
      sum += value;
    }
    x_.push_back(sum);
  }

  std::size_t values() const { return values_; }
  std::size_t missing() const { return missing_; }
  std::size_t holes() const { return holes_; }
  std::size_t size() const { return size_; }  ///< of all records, with their missing values
  double slope() const { return slope_; }     ///< per sample

  /// At most half of the size.
  AllanVariance at(std::size_t m) const {
    const double size = static_cast<double>(m), rise = slope_ * size * size;
    AllanVariance found{.m = m};
    for (const Record& record : records_) {
      for (std::size_t i = record.begin; i + 2 * m <= record.end; ++i) {
        double d = x_[i + 2 * m] - 2 * x_[i + m] + x_[i];
        if (!lost_.empty()) {
          const std::uint32_t first = lost_[i + m] - lost_[i], second = lost_[i + 2 * m] - lost_[i + m];
          if (20 * std::size_t{std::max(first, second)} > m) continue;
          const double a = size / (size - first), b = size / (size - second);
          if (first + second > 0)
            d = (b * (x_[i + 2 * m] - x_[i + m]) - a * (x_[i + m] - x_[i])) * std::sqrt(2 / (a + b));
        }
        found.flat += d * d;
        found.raw += (d + rise) * (d + rise);
        ++found.windows;
      }
    }
    const double windows = static_cast<double>(found.windows), divisor = 2 * size * size * std::max(windows, 1.0);
    found.flat /= divisor;
    found.raw /= divisor;
    found.share = windows / static_cast<double>(size_ - 2 * m + 1);
    return found;
  }

 private:
  void find_records() {
    Record open;
    for (std::size_t i = 0; i <= x_.size(); ++i) {
      const bool known = i < x_.size() && std::isfinite(x_[i]), before = i > 0 && std::isfinite(x_[i - 1]);
      if (i == x_.size() || std::isinf(x_[i])) {
        if (open.end > open.begin) records_.push_back(std::exchange(open, {}));
      } else if (known) {
        if (open.end == 0) open.begin = i;
        open.end = i + 1;
        ++values_;
      } else {
        ++missing_;
      }
      holes_ += i < x_.size() && !known && (before || i == 0);
    }
    for (const Record& record : records_) size_ += record.size();
  }

  /// The slope between the thirds of the longest record.
  void find_line() {
    const auto longest = std::max_element(records_.begin(), records_.end(),
                                          [](const Record& a, const Record& b) { return a.size() < b.size(); });
    if (longest == records_.end()) return;
    const std::size_t third = longest->size() / 3;
    const auto [first, first_at] = mean(longest->begin, longest->begin + third);
    const auto [last, last_at] = mean(longest->end - third, longest->end);
    if (third > 0) slope_ = (last - first) / (last_at - first_at);
    std::tie(level_, centre_) = mean(0, x_.size());
  }

  /// Of the values that are there, and of their positions.
  std::pair<double, double> mean(std::size_t begin, std::size_t end) const {
    double sum = 0, positions = 0, count = 0;
    for (std::size_t i = begin; i < end; ++i) {
      if (std::isfinite(x_[i])) sum += x_[i], positions += static_cast<double>(i), ++count;
    }
    return {sum / count, positions / count};
  }

  std::vector<double> x_;            // the rates, then their running sum: one element more
  std::vector<std::uint32_t> lost_;  // number of missing values before each element of x_, if there are any
  std::vector<Record> records_;
  std::size_t values_ = 0, missing_ = 0, holes_ = 0, size_ = 0;
  double level_ = 0, centre_ = 0, slope_ = 0;
};

std::vector<std::size_t> cluster_sizes(AllanGrid grid, std::size_t values) {
  std::vector<std::size_t> sizes;
  const std::size_t base = grid == AllanGrid::kOctave ? 2 : 10, largest = values / kFewestClusters;
  for (std::size_t decade = 1; decade <= largest; decade *= base) {
    for (const std::size_t digit : {1, 2, 4}) {
      if (digit * decade <= largest && (digit == 1 || grid == AllanGrid::kDecade)) sizes.push_back(digit * decade);
    }
  }
  return sizes;
}

/// The variances that have enough pairs of clusters.
std::vector<AllanVariance> measure(const Phase& phase, AllanGrid grid) {
  std::vector<AllanVariance> all;
  for (const std::size_t m : cluster_sizes(grid, phase.size())) {
    const AllanVariance found = phase.at(m);
    if (found.share * allan_edf(phase.size(), m, {0, 0, 0, 1}) >= kLeastEdf) all.push_back(found);
  }
  return all;
}

/// Coefficients of strengths: per sample to the units of AllanCoefficients.
AllanCoefficients coefficients_of(const AllanFit& fit, double tau0_s) {
  const double h = tau0_s / 3600;
  const double unit[] = {tau0_s, std::sqrt(h), 1 / std::sqrt(kFlicker), 1 / std::sqrt(h), 1 / h};
  AllanCoefficients all;
  for (std::size_t k = 0; k < kNoiseTypes; ++k) {
    const bool ramp = k == static_cast<std::size_t>(NoiseType::kRateRamp);
    const StrengthInterval& found = ramp ? fit.slope : fit.strengths[k];
    const auto in_units = [&](double strength) { return unit[k] * (ramp ? strength : std::sqrt(strength)); };
    if (found.given) all[k].value = in_units(found.value);
    all[k].low = in_units(std::max(found.low, 0.0));
    all[k].high = in_units(found.high);
  }
  return all;
}

/// A point with the interval that follows from the strengths. A ramp has no part in the width of the interval.
AllanPoint point_of(const AllanVariance& found, const Phase& phase, double tau0_s, const NoiseStrengths& noise,
                    bool ramp) {
  const double size = static_cast<double>(found.m), rise = ramp ? phase.slope() * size : 0;
  const double random = ramp ? found.flat : found.raw, fixed = found.raw - random;
  AllanPoint point{.m = found.m, .tau_s = size * tau0_s, .deviation = std::sqrt(found.raw), .windows = found.windows};
  point.edf = found.share * allan_edf(phase.size(), found.m, noise);
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

Result<AllanAnalysis> analyse_allan(std::vector<double> rate, double tau0_s, AllanGrid grid, const std::string& where) {
  if (!(tau0_s > 0) || !std::isfinite(tau0_s))
    return make_error(where, fmt::format("found a sample interval of {} s, expected a positive number", tau0_s));
  const Phase phase(std::move(rate));
  const std::vector<AllanVariance> octaves = measure(phase, AllanGrid::kOctave);
  if (octaves.empty()) {
    return make_error(where, fmt::format("found {} values with {} gaps, expected at least {} without a gap",
                                         phase.values(), phase.holes(), kFewestClusters));
  }
  double raw = 0, flat = 0;  // the largest
  for (const AllanVariance& each : octaves) {
    raw = std::max(raw, each.raw);
    flat = std::max(flat, each.flat);
  }
  if (!(raw > 0)) return make_error(where, "found an Allan deviation of 0, expected a rate that varies");

  AllanAnalysis result;
  result.tau0_s = tau0_s;
  result.values = phase.values();
  result.missing = phase.missing();
  result.holes = phase.holes();
  AllanFit fit;
  fit.noise[1] = raw;  // white noise, for the intervals of the points
  if (octaves.size() < 3) {
    result.coefficients =
        make_error(where, fmt::format("found {}, expected 3 or more: 32 values", counted(octaves.size(), "octave")));
  } else if (flat < 1e-20 * raw) {
    result.coefficients = make_error(where, "the rate is a straight line, without noise");
  } else {
    fit = fit_allan(phase.size(), phase.slope(), octaves);
    result.coefficients = coefficients_of(fit, tau0_s);
    for (std::size_t i = 0; i < octaves.size(); ++i) {
      if (std::abs(fit.misses[i]) > kMissSigma)
        result.unexplained_s.push_back(static_cast<double>(octaves[i].m) * tau0_s);
    }
  }
  for (const AllanVariance& found : grid == AllanGrid::kOctave ? octaves : measure(phase, grid))
    result.points.push_back(point_of(found, phase, tau0_s, fit.noise, fit.slope.given));
  return result;
}

double allan_deviation(std::vector<double> rate, std::size_t m) { return std::sqrt(Phase(std::move(rate)).at(m).raw); }

WhiteNoiseDensity white_noise_density(double angle_random_walk_deg_per_sqrt_h) {
  const double deg_per_sqrt_s = angle_random_walk_deg_per_sqrt_h / 60;
  return {deg_per_sqrt_s * std::numbers::pi / 180, std::numbers::sqrt2 * deg_per_sqrt_s};
}

}  // namespace prism::evaluation
