// SPDX-License-Identifier: MIT
#include "compensation/evaluation/improvement_interval.hpp"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>
#include <vector>

namespace prism::evaluation {
namespace {

constexpr std::size_t kLeast = 20;
constexpr int kDraws = 1000;

/// Divisor N. The values were checked by summarise() before: this is called for every resample.
double sd_of(std::span<const double> values) {
  double sum = 0, squares = 0;
  for (const double v : values) sum += v;
  const double mean = sum / static_cast<double>(values.size());
  for (const double v : values) squares += (v - mean) * (v - mean);
  return std::sqrt(squares / static_cast<double>(values.size()));
}

/// Contribution of each pair to the logarithm of the ratio (its influence function, times two): determines the block
/// length.
std::vector<double> influence(std::span<const double> before, std::span<const double> after) {
  const auto squares = [](std::span<const double> values) {
    std::vector<double> result(values.begin(), values.end());
    const double sd = sd_of(result), mean = neumaier_sum(values) / static_cast<double>(values.size());
    for (double& value : result) value = (value - mean) * (value - mean) / (sd * sd);
    return result;
  };
  const std::vector<double> raw = squares(before);
  std::vector<double> left = squares(after);
  for (std::size_t i = 0; i < left.size(); ++i) left[i] -= raw[i];
  return left;
}

/// A statistic of the complete recording, and its standard deviation over the resamples.
struct BootstrapEstimate {
  double here, sd;
};
BootstrapEstimate bootstrap(std::size_t n, std::size_t block,
                            const std::function<double(const std::vector<std::size_t>&)>& statistic) {
  std::mt19937_64 random(2019);
  std::vector<std::size_t> from(n);
  std::iota(from.begin(), from.end(), std::size_t{0});
  const double here = statistic(from);
  std::vector<double> drawn;
  for (int draw = 0; draw < kDraws; ++draw) {
    for (std::size_t i = 0, start = 0; i < n; ++i) {
      if (i % block == 0) start = random() % n;
      from[i] = (start + i % block) % n;
    }
    drawn.push_back(statistic(from));
  }
  return {here, sd_of(drawn)};
}

/// Possible distance of the next recording from this one, in standard deviations of either.
double reach(std::size_t n, std::size_t block) {
  const double freedom = std::max(2.0, static_cast<double>(n) / static_cast<double>(block) - 1);
  return std::sqrt(2.0) * boost::math::quantile(boost::math::students_t(freedom), 0.975);
}

bool usable(std::span<const double> before, std::span<const double> after) {
  const auto varies = [](std::span<const double> series) {
    const auto summary = summarise(series, Divisor::kN);
    return summary && summary->sd > 0;
  };
  return before.size() == after.size() && before.size() >= kLeast && varies(before) && varies(after);
}

/// Number of lags until the autocorrelation stays within its band (Politis and White 2004, footnote c); all if it never
/// does.
std::size_t memory(const std::vector<double>& coefficient, std::size_t n) {
  constexpr std::size_t kQuiet = 5;  // more than √log10 n for each n
  const double band = 2 * std::sqrt(std::log10(static_cast<double>(n)) / static_cast<double>(n));
  std::size_t run = 0;
  for (std::size_t lag = 1; lag < coefficient.size(); ++lag) {
    run = std::abs(coefficient[lag]) < band ? run + 1 : 0;
    if (run == kQuiet) return lag - kQuiet;
  }
  return coefficient.size();
}

}  // namespace

std::size_t bootstrap_block(std::span<const double> values) {
  const std::size_t n = values.size(), most = std::max<std::size_t>(1, n / 4);
  const auto correlation = autocorrelate(values, n / 2);
  if (!correlation) return 1;
  const std::vector<double>& r = correlation->coefficient;
  const std::size_t width = std::min(2 * std::max<std::size_t>(1, memory(r, n)), r.size() - 1);
  double level = r[0], slope = 0;
  for (std::size_t lag = 1; lag <= width; ++lag) {
    const double t = static_cast<double>(lag) / static_cast<double>(width);
    const double weight = t <= 0.5 ? 1 : 2 * (1 - t);
    level += 2 * weight * r[lag];
    slope += 2 * weight * static_cast<double>(lag) * r[lag];
  }
  const double length = std::cbrt(2 * slope * slope / (4.0 / 3.0 * level * level) * static_cast<double>(n));
  if (!(length < static_cast<double>(most))) return most;
  return std::max<std::size_t>(1, static_cast<std::size_t>(std::ceil(length)));
}

std::optional<Estimate> next_improvement(std::span<const double> before, std::span<const double> after) {
  if (!usable(before, after)) return std::nullopt;
  const std::size_t n = before.size(), block = bootstrap_block(after);
  std::vector<double> raw(n), left(n);
  const auto statistic = [&](const std::vector<std::size_t>& from) {
    for (std::size_t i = 0; i < n; ++i) {
      left[i] = after[from[i]];
      raw[i] = before[i] - after[i] + left[i];
    }
    return std::log(sd_of(left) / sd_of(raw));
  };
  const auto [here, sd] = bootstrap(n, block, statistic);
  const double far = std::hypot(std::sqrt(1 - kRepeats) * reach(n, block) * sd, std::sqrt(2.0) * 1.96 * kBetweenDays);
  return Estimate{1 - std::exp(here), 1 - std::exp(here + far), 1 - std::exp(here - far)};
}

std::optional<Estimate> next_of_several(std::span<const double> improvements) {
  if (improvements.size() < 3) return std::nullopt;
  std::vector<double> left;
  for (const double improvement : improvements) left.push_back(std::log(1 - improvement));
  const auto summary = summarise(left, Divisor::kNMinus1);  // of 1 and more the logarithm is not finite
  if (!summary) return std::nullopt;
  const auto n = static_cast<double>(left.size());
  const double quantile = boost::math::quantile(boost::math::students_t(n - 1), 0.975);
  const double far = quantile * summary->sd * std::sqrt(1 + 1 / n), here = summary->mean;
  return Estimate{1 - std::exp(here), 1 - std::exp(here + far), 1 - std::exp(here - far)};
}

std::optional<Estimate> next_difference(std::span<const double> before, std::span<const double> first,
                                        std::span<const double> second) {
  if (!usable(before, first) || !usable(before, second)) return std::nullopt;
  const std::size_t n = before.size();
  const std::size_t block =
      std::max(bootstrap_block(influence(before, first)), bootstrap_block(influence(before, second)));
  std::vector<double> drawn(n);
  const auto sd_drawn = [&](std::span<const double> values, const std::vector<std::size_t>& from) {
    for (std::size_t i = 0; i < n; ++i) drawn[i] = values[from[i]];
    return sd_of(drawn);
  };
  const auto statistic = [&](const std::vector<std::size_t>& from) {
    return (sd_drawn(first, from) - sd_drawn(second, from)) / sd_drawn(before, from);
  };
  const auto [here, sd] = bootstrap(n, block, statistic);
  const double far = reach(n, block) * sd;
  return Estimate{here, here - far, here + far};
}

}  // namespace prism::evaluation
