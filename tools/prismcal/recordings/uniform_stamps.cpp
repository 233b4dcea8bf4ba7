// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/uniform_stamps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace prism::recordings {
namespace {

/// The two lengths of the steps, ns. Those above `limit` are pauses.
struct Steps {
  std::int64_t shortest = std::numeric_limits<std::int64_t>::max(), longest = 0, limit = 0;
  double resolution() const { return static_cast<double>(longest - shortest); }
};

Steps steps_of(const PackedStamps& stamps) {
  Steps steps;
  for_each_step(stamps, [&](std::size_t, std::int64_t step) {
    steps.shortest = std::min(steps.shortest, step), steps.longest = std::max(steps.longest, step);
  });
  steps.limit = steps.longest;
  return steps;
}

/// The longer one of the two lengths is the one next to the shortest.
Steps steps_between_pauses(const PackedStamps& stamps, Steps steps) {
  constexpr std::int64_t kExact_ns = 2000;  // days of Excel, and seconds since 1970, are as fine
  const std::int64_t shortest = steps.shortest;
  for_each_step(stamps, [&](std::size_t, std::int64_t step) {
    if (step > shortest + kExact_ns) steps.longest = std::min(steps.longest, step);
  });
  steps.limit = steps.longest + (steps.longest - shortest) / 2;
  return steps;
}

/// The mean step without pauses, ns, if the steps have only two lengths, from a row on. Before it, the stamps are
/// finer, and the steps nearer to the mean.
std::optional<double> mean_of_two_lengths(const PackedStamps& stamps, const Steps& steps) {
  double sum = 0;
  std::size_t count = 0, pauses = 0;
  for_each_step(stamps, [&](std::size_t, std::int64_t step) {
    if (step > steps.limit)
      ++pauses;
    else
      sum += static_cast<double>(step), ++count;
  });
  if (!(sum > 0)) return std::nullopt;
  const double mean = sum / static_cast<double>(count);
  // Of the mean too: a hole of 400 samples must not make 1 and 2 samples the same.
  const double near = 0.02 * std::min(steps.resolution(), mean);
  std::size_t shorter = 0, longer = 0;
  bool fit = true;
  for_each_step(stamps, [&](std::size_t, std::int64_t step) {
    if (step > steps.limit) return;
    if (static_cast<double>(step - steps.shortest) <= near)
      ++shorter;
    else if (std::fabs(static_cast<double>(step - steps.longest)) <= near)
      ++longer;
    else
      fit = fit && shorter + longer == 0 && std::fabs(static_cast<double>(step) - mean) <= 0.5 * mean;
  });
  constexpr std::size_t kProof = 10;
  const bool proved = pauses == 0 || std::min(shorter, longer) >= kProof * (pauses + 1);
  return fit && proved ? std::optional(mean) : std::nullopt;
}

/// All runs of equal stamps have the same number of stamps, except the first and the last, of which parts may be
/// missing. Long runs may differ by 1 %: stamps in the middle between two ticks are rounded to either side.
bool are_equal_batches(const PackedStamps& stamps) {
  std::size_t begin = 0, runs = 0, least = std::numeric_limits<std::size_t>::max(), most = 0;
  for_each_step(stamps, [&](std::size_t i, std::int64_t step) {
    if (step == 0) return;
    if (runs > 0) least = std::min(least, i - begin), most = std::max(most, i - begin);
    ++runs, begin = i;
  });
  return runs > 2 && least > 1 && most - least <= most / 100;
}

/// Of the stamps less `slope` times their row: the widest of the strips between pauses.
struct Strip {
  double slope = 0, width = 0;
  double change = 0;  ///< of the width with the slope: the row of the lowest stamp less that of the highest
};

/// Calls visit(row, low, lowest, high, highest) for each run between pauses: its first row, its least and its largest
/// lateness against the slope, ns, and their rows.
template <class Visit>
void for_each_run(const PackedStamps& stamps, double slope, std::int64_t limit, Visit&& visit) {
  double low = 0, high = 0;
  std::size_t lowest = 0, highest = 0, begin = 0;
  for_each_step(stamps, [&, time = std::int64_t{0}](std::size_t i, std::int64_t step) mutable {
    time += step;
    const double late = static_cast<double>(time) - static_cast<double>(i) * slope;
    if (step > limit) {
      visit(begin, low, lowest, high, highest);
      low = high = late, begin = lowest = highest = i;
    }
    if (late < low) low = late, lowest = i;
    if (late > high) high = late, highest = i;
  });
  visit(begin, low, lowest, high, highest);
}

Strip strip_of(const PackedStamps& stamps, double slope, std::int64_t limit) {
  Strip widest{slope, -1, 0};
  for_each_run(stamps, slope, limit,
               [&](std::size_t, double low, std::size_t lowest, double high, std::size_t highest) {
                 if (high - low <= widest.width) return;
                 widest.width = high - low;
                 widest.change = static_cast<double>(lowest) - static_cast<double>(highest);
               });
  return widest;
}

std::vector<SampleHole> pauses_of(const PackedStamps& stamps, double slope, std::int64_t limit) {
  std::vector<SampleHole> pauses;
  double before = 0;
  for_each_run(stamps, slope, limit, [&](std::size_t row, double low, std::size_t, double high, std::size_t) {
    const double middle = (low + high) / 2;
    const auto lost = row > 0 ? std::llround((middle - before) / slope) : 0;
    if (lost > 0) pauses.push_back({row, static_cast<std::size_t>(lost)});
    before = middle;
  });
  return pauses;
}

/// The narrowest strip, if it is not wider than `most`. The width is a convex function of the slope. Its tangents at
/// a slope that is too low and at one that is too high meet at the next slope, and below the least width.
std::optional<Strip> narrowest_strip(const PackedStamps& stamps, double slope, std::int64_t limit, double most) {
  constexpr int kMostPasses = 40;
  constexpr double kClose = 0.002;
  Strip best = strip_of(stamps, slope, limit);
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
    strip = strip_of(stamps, slope, limit);
    if (strip.width < best.width) best = strip;
  }
  return best.width <= most ? std::optional(best) : std::nullopt;
}

std::optional<UniformStamps> fit(const PackedStamps& stamps, const Steps& steps) {
  constexpr double kSlack = 0.25;
  const double resolution = steps.resolution();
  if (!(resolution > 0)) return std::nullopt;
  const auto mean = mean_of_two_lengths(stamps, steps);
  if (!mean) return std::nullopt;
  const auto strip = narrowest_strip(stamps, *mean, steps.limit, resolution + kSlack * std::min(resolution, *mean));
  if (!strip) return std::nullopt;
  return UniformStamps{strip->slope, resolution, strip->width / resolution, are_equal_batches(stamps),
                       pauses_of(stamps, strip->slope, steps.limit)};
}

}  // namespace

std::optional<UniformStamps> uniform_stamps(const PackedStamps& stamps) {
  const Steps steps = steps_of(stamps);
  if (auto whole = fit(stamps, steps)) return whole;
  return fit(stamps, steps_between_pauses(stamps, steps));
}

}  // namespace prism::recordings
