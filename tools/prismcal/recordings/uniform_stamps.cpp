// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/uniform_stamps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace prism::recordings {
namespace {

struct Steps {
  std::int64_t shortest = std::numeric_limits<std::int64_t>::max(), longest = 0;
  double resolution() const { return static_cast<double>(longest - shortest); }
};

Steps steps_of(const PackedStamps& stamps) {
  Steps steps;
  for_each_step(stamps, [&](std::size_t, std::int64_t step) {
    steps.shortest = std::min(steps.shortest, step), steps.longest = std::max(steps.longest, step);
  });
  return steps;
}

/// The steps have only two lengths, from a row on. Before it, the stamps are finer, and the steps nearer to the mean.
bool have_two_lengths(const PackedStamps& stamps, const Steps& steps) {
  const double mean = static_cast<double>(stamps.back() - stamps.front()) / static_cast<double>(stamps.size() - 1);
  // Of the mean too: a hole of 400 samples must not make 1 and 2 samples the same.
  const double near = 0.02 * std::min(steps.resolution(), mean);
  bool coarse = false, fit = true;
  for_each_step(stamps, [&](std::size_t, std::int64_t step) {
    if (static_cast<double>(std::min(step - steps.shortest, steps.longest - step)) <= near)
      coarse = true;
    else
      fit = fit && !coarse && std::fabs(static_cast<double>(step) - mean) <= 0.5 * mean;
  });
  return fit;
}

/// All runs of equal stamps have the same number of stamps, except the first and the last, of which parts may be
/// missing.
bool are_equal_batches(const PackedStamps& stamps) {
  std::size_t begin = 0, runs = 0, rows = 0;
  bool equal = true;
  for_each_step(stamps, [&](std::size_t i, std::int64_t step) {
    if (step == 0) return;
    if (runs == 1) rows = i - begin;
    equal = equal && (runs < 2 || i - begin == rows);
    ++runs, begin = i;
  });
  return equal && runs > 2 && rows > 1;
}

/// Of the stamps less `slope` times their row.
struct Strip {
  double slope = 0, width = 0;
  double change = 0;  ///< of the width with the slope: the rows of the lowest stamp less those of the highest
};

Strip strip_of(const PackedStamps& stamps, double slope) {
  const std::int64_t first = stamps.front();
  double low = 0, high = 0;
  std::size_t lowest = 0, highest = 0;
  stamps.for_each(1, stamps.size(), [&](std::size_t i, std::int64_t stamp) {
    const double late = static_cast<double>(stamp - first) - static_cast<double>(i) * slope;
    if (late < low) low = late, lowest = i;
    if (late > high) high = late, highest = i;
  });
  return {slope, high - low, static_cast<double>(lowest) - static_cast<double>(highest)};
}

/// The narrowest strip, if it is not wider than `most`. The width is a convex function of the slope. Its tangents at
/// a slope that is too low and at one that is too high meet at the next slope, and below the least width.
std::optional<Strip> narrowest_strip(const PackedStamps& stamps, double slope, double most) {
  constexpr int kMostPasses = 40;
  constexpr double kClose = 0.002;
  Strip best = strip_of(stamps, slope);
  std::optional<Strip> low, high;
  Strip strip = best;
  for (int pass = 0; pass < kMostPasses && strip.change != 0; ++pass) {
    (strip.change < 0 ? low : high) = strip;
    if (low && high) {
      const double ahead = (high->width - low->width + high->change * (low->slope - high->slope)) /
                           (low->change - high->change);  // of low->slope
      const double bound = low->width + low->change * ahead;
      if (bound > most || best.width - bound <= kClose * most) break;
      slope = low->slope + ahead;
    } else {
      slope = strip.slope - strip.width / strip.change;
    }
    strip = strip_of(stamps, slope);
    if (strip.width < best.width) best = strip;
  }
  return best.width <= most ? std::optional(best) : std::nullopt;
}

}  // namespace

std::optional<UniformStamps> uniform_stamps(const PackedStamps& stamps) {
  constexpr double kMostWidth = 1.25;
  const Steps steps = steps_of(stamps);
  const double resolution = steps.resolution();
  if (!(resolution > 0) || !have_two_lengths(stamps, steps)) return std::nullopt;
  const double mean = static_cast<double>(stamps.back() - stamps.front()) / static_cast<double>(stamps.size() - 1);
  const auto strip = narrowest_strip(stamps, mean, kMostWidth * resolution);
  if (!strip) return std::nullopt;
  return UniformStamps{strip->slope, resolution, strip->width / resolution, are_equal_batches(stamps)};
}

}  // namespace prism::recordings
