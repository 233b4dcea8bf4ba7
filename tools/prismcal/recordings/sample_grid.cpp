// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/sample_grid.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/plain_text.hpp"
#include "base/text_number.hpp"
#include "tools/prismcal/recordings/sliding_minimum.hpp"
#include "tools/prismcal/recordings/uniform_stamps.hpp"

namespace prism::recordings {
namespace {

using Stamps = PackedStamps;

std::size_t rank_of(double q, std::size_t values) {
  return static_cast<std::size_t>(q * static_cast<double>(values - 1) + 0.5);
}

double quantile_of(std::vector<double>& values, double q) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(rank_of(q, values.size()));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The value with that rank, from 0, in the order of size, of values >= 0; in constant memory. for_each(visit) calls
/// visit(value) for each. The bits of such numbers have the order of the numbers: each pass finds 16 of them.
template <class ForEach>
double value_of_rank(std::size_t rank, ForEach&& for_each) {
  constexpr int kDigit = 16;
  std::vector<std::size_t> counts(std::size_t{1} << kDigit);
  std::uint64_t found = 0;
  for (int shift = 64 - kDigit; shift >= 0; shift -= kDigit) {
    std::fill(counts.begin(), counts.end(), 0);
    for_each([&](double value) {
      const auto bits = std::bit_cast<std::uint64_t>(value) >> shift;
      if (bits >> kDigit == found) ++counts[bits & (counts.size() - 1)];
    });
    std::size_t digit = 0;
    for (; rank >= counts[digit]; ++digit) rank -= counts[digit];
    found = found << kDigit | digit;
  }
  return std::bit_cast<double>(found);
}

/// The quantile q of the steps, ns.
double quantile_of_steps(const Stamps& stamps, double q) {
  return value_of_rank(rank_of(q, stamps.size() - 1), [&](auto&& visit) {
    for_each_step(stamps, [&](std::size_t, std::int64_t step) { visit(static_cast<double>(step)); });
  });
}

/// Spans of `rows` rows each, ns.
std::vector<double> spans_of(const Stamps& stamps, std::size_t rows) {
  constexpr std::size_t kMostSpans = 4000;
  std::vector<double> spans;
  const std::size_t blocks = (stamps.size() - 1) / rows, stride = std::max<std::size_t>(1, blocks / kMostSpans);
  for (std::size_t i = 0; i < blocks; i += stride) {
    // Not evenly spaced: a stride of an even number would see only one half of an alternation.
    const std::size_t b = std::min(blocks - 1, i + i / stride * 7919 % stride);
    spans.push_back(static_cast<double>(stamps[(b + 1) * rows] - stamps[b * rows]));
  }
  return spans;
}

struct FirstGuess {
  double interval_ns = 0;
  std::size_t rows = 1;  ///< rows after which the pattern of the stamps repeats
};

/// The fewest rows whose span is nearly constant: 1 for exact stamps, 2 for alternating ones, the batch's size for
/// batches, many for jitter. Few rows, because lost samples must not be in most of the spans.
FirstGuess first_guess(const Stamps& stamps) {
  constexpr double kConstant = 0.004;
  FirstGuess best;
  double least = 1e9;
  for (std::size_t rows = 1; rows == 1 || rows * 4 <= stamps.size() - 1; rows = std::max(rows + 1, rows + rows / 5)) {
    std::vector<double> spans = spans_of(stamps, rows);
    const double middle = quantile_of(spans, 0.5);
    if (!(middle > 0)) continue;
    const double spread = (quantile_of(spans, 0.84) - quantile_of(spans, 0.16)) / 2 / middle;
    if (spread >= least) continue;
    least = spread;
    best = {middle / static_cast<double>(rows), rows};
    // The mean over spans without a loss is finer than the resolution of the stamps.
    double sum = 0;
    std::size_t count = 0;
    const double width = std::max(0.45 * best.interval_ns, 1e-3 * middle);
    for (const double span : spans) {
      if (std::fabs(span - middle) > width) continue;
      sum += span;
      ++count;
    }
    if (spread * middle < 0.3 * best.interval_ns)  // then a span is within the width
      best.interval_ns = sum / static_cast<double>(count) / static_cast<double>(rows);
    if (spread <= kConstant) break;
  }
  return best;
}

/// Middle range of the stamps against the count, within blocks of the pattern.
double noise_of(const Stamps& stamps, const FirstGuess& guess) {
  const std::size_t rows = std::min(std::max<std::size_t>(guess.rows, 16), stamps.size());
  std::vector<double> ranges;
  std::int64_t first = 0;
  std::size_t row = 0;  // in the block
  double low = 0, high = 0;
  stamps.for_each(0, stamps.size(), [&](std::size_t, std::int64_t stamp) {
    if (row == 0) first = stamp, low = high = 0;
    const double late = static_cast<double>(stamp - first) - static_cast<double>(row) * guess.interval_ns;
    low = std::min(low, late), high = std::max(high, late);
    if (++row < rows) return;
    ranges.push_back(high - low);
    row = 0;
  });
  return ranges.empty() ? 0 : quantile_of(ranges, 0.5);
}

/// How stamps are compared: rows of the envelope (1: the stamps are exact), rows needed after a hole, and rows within
/// which two holes are one: within a batch of equal stamps they cannot be told apart.
struct Envelope {
  std::size_t window = 1, least_after = 1, near = 0;
};

/// Most steps are the interval or a multiple of it: each step alone shows its loss.
bool are_exact(const Stamps& stamps, double interval_ns) {
  return value_of_rank(rank_of(0.7, stamps.size() - 1), [&](auto&& visit) {
           for_each_step(stamps, [&](std::size_t, std::int64_t step) {
             const double steps = static_cast<double>(step) / interval_ns;
             visit(std::fabs(steps - std::max(1.0, std::round(steps))));
           });
         }) < 0.02;
}

Envelope envelope_of(const FirstGuess& guess, double noise_ns, const Stamps& stamps) {
  const double noise = noise_ns / guess.interval_ns;
  if (noise < 0.3 || are_exact(stamps, guess.interval_ns)) return {};
  const auto samples = static_cast<std::size_t>(std::min(noise, 1000.0) + 0.5);
  Envelope envelope;
  envelope.window = std::clamp<std::size_t>(std::max(2 * guess.rows, 8 * samples), 16, 512);
  envelope.least_after = std::max<std::size_t>(8, std::min(envelope.window, 2 * std::max(guess.rows, samples)));
  envelope.near = std::min<std::size_t>(std::max(guess.rows, 2 * samples), 32);
  return envelope;
}

void add_hole(SampleHole hole, const Envelope& envelope, std::vector<SampleHole>& holes, SampleHole& last) {
  const bool joins = !holes.empty() && hole.row - last.row <= envelope.near;
  if (!joins) {
    holes.push_back(hole);
  } else {
    if (hole.lost > last.lost) holes.back().row = hole.row;
    holes.back().lost += hole.lost;
    hole.lost = std::max(hole.lost, last.lost);
  }
  last = hole;
}

std::vector<SampleHole> holes_of(const Stamps& stamps, double interval_ns, const Envelope& envelope) {
  const std::size_t window = envelope.window, n = stamps.size();
  const std::int64_t first = stamps.front();
  // Lateness of a row against the count, ns.
  const auto late = [&](std::size_t i) {
    return static_cast<double>(stamps[i] - first) - static_cast<double>(i) * interval_ns;
  };
  std::vector<SampleHole> holes;
  SampleHole last;
  double shift = 0;
  SlidingMinimum forward(window), backward(window);  // forward: of the row and those after it
  backward.push(late(0));
  for (std::size_t i = 1; i < n; ++i) {
    while (forward.count() < std::min(n, i + window)) forward.push(late(forward.count()));
    forward.drop_before(i);
    const double rise = (forward.value() - shift - backward.value()) / interval_ns;
    // At the end of the record too few rows remain to tell a late stamp from a loss.
    const bool certain = i + envelope.least_after <= n;
    if (rise > (window == 1 ? 0.5 : 0.6) && certain) {
      std::size_t row = i;
      for (std::size_t j = i + 1; j < std::min(n, i + 3) && window > 1; ++j) {
        if (stamps[j] - stamps[j - 1] > stamps[row] - stamps[row - 1]) row = j;
      }
      const auto lost = static_cast<std::size_t>(std::max<long long>(1, std::llround(rise)));
      for (std::size_t j = i; j < row; ++j) backward.push(late(j) - shift);
      add_hole({row, lost}, envelope, holes, last);
      shift += static_cast<double>(lost) * interval_ns;
      i = row;
    }
    backward.push(late(i) - shift);
  }
  return holes;
}

/// Slope of the stamps over the count, from the runs between holes.
double slope_of(const Stamps& stamps, const std::vector<SampleHole>& holes, double fallback_ns) {
  double covariance = 0, variance = 0;
  for (std::size_t h = 0; h <= holes.size(); ++h) {
    const std::size_t begin = h == 0 ? 0 : holes[h - 1].row, end = h == holes.size() ? stamps.size() : holes[h].row;
    if (end - begin < 2) continue;
    const double middle = static_cast<double>(end - begin - 1) / 2;
    double mean = 0;
    const std::int64_t first = stamps[begin];
    stamps.for_each(begin, end, [&](std::size_t, std::int64_t stamp) { mean += static_cast<double>(stamp - first); });
    mean /= static_cast<double>(end - begin);
    stamps.for_each(begin, end, [&](std::size_t i, std::int64_t stamp) {
      const double x = static_cast<double>(i - begin) - middle;
      covariance += x * (static_cast<double>(stamp - first) - mean);
      variance += x * x;
    });
  }
  return variance > 0 && covariance > 0 ? covariance / variance : fallback_ns;
}

/// The usual step, ns, if nearly all steps are equal within 1 %, and a few rows repeat the time of the row before: the
/// same row written twice, or a leap second. The count over the span would be wrong by these rows.
std::optional<double> step_of_repeating(const Stamps& stamps, double median_ns, std::size_t repeated) {
  if (repeated == 0 || !(median_ns > 0)) return std::nullopt;
  double sum = 0;
  std::size_t count = 0;
  for_each_step(stamps, [&](std::size_t, std::int64_t step) {
    const auto length = static_cast<double>(step);
    if (std::fabs(length - median_ns) <= 0.01 * median_ns) sum += length, ++count;
  });
  constexpr double kNearlyAll = 0.98;
  if (static_cast<double>(count) < kNearlyAll * static_cast<double>(stamps.size() - 1)) return std::nullopt;
  return sum / static_cast<double>(count);
}

/// How the stamps are read.
struct Reading {
  FirstGuess guess;                      ///< its interval is the final one
  bool known = false;                    ///< the interval was given
  bool repeats = false;                  ///< a few rows repeat the time of the row before
  std::optional<UniformStamps> uniform;  ///< the stamps fit a series without a loss too
  bool no_loss = false;                  ///< that series is the right one
};

void find_holes(const Stamps& stamps, Reading& reading, SampleGrid& grid) {
  double& interval_ns = reading.guess.interval_ns;
  const Envelope envelope = envelope_of(reading.guess, noise_of(stamps, reading.guess), stamps);
  for (int pass = 0; pass < 3; ++pass) {
    grid.holes = holes_of(stamps, interval_ns, envelope);
    if (!reading.known && !reading.repeats) interval_ns = slope_of(stamps, grid.holes, interval_ns);
  }
}

/// Stamps whose resolution is little less than the sample time, or more, seem to lose samples at even distances.
void judge_no_loss(const Stamps& stamps, Reading& reading, SampleGrid& grid) {
  constexpr std::size_t kProof = 10;  // fewer jumps can be that even by chance
  const std::size_t jumps = grid.holes.size() + (reading.repeats ? grid.repeated : 0);
  if (reading.known || jumps == 0) return;
  reading.uniform = uniform_stamps(stamps);
  if (!reading.uniform) return;
  // Pauses are holes in both readings: then the sample time shows which one is wrong.
  const bool differ = std::fabs(reading.uniform->interval_ns / reading.guess.interval_ns - 1) > 0.005;
  reading.no_loss = jumps >= kProof || reading.uniform->batches ||
                    (differ && reading.uniform->exact() && !reading.uniform->pauses.empty());
  if (!reading.no_loss) return;
  grid.holes = reading.uniform->pauses;
  reading.repeats = false;
  reading.guess.interval_ns = reading.uniform->interval_ns;
}

/// Why the sample time is not the median step.
std::string reason_of(const SampleGrid& grid, const Reading& reading, std::size_t rows) {
  if (reading.no_loss)
    return fmt::format("stamps are rounded to {:.6g} s or alternate: they jump evenly, so that nothing is lost",
                       reading.uniform->resolution_ns * 1e-9);
  if (grid.repeated * 100 > rows) return "stamps repeat: they are coarse or come in batches";
  if (grid.lost > 0) return "samples are lost";
  return grid.regular ? "" : "stamps jitter, alternate or are rounded";
}

void describe(SampleGrid& grid, const Reading& reading, std::size_t rows) {
  if (std::fabs(grid.mean_step_s / grid.median_step_s - 1) > 0.01 || !grid.regular)
    grid.remark = fmt::format("mean step {:.6g} s, median step {:.6g} s; used: {:.6g} s, count over span{}; {}",
                              grid.mean_step_s, grid.median_step_s, grid.interval_s,
                              grid.holes.empty() ? "" : " between holes", reason_of(grid, reading, rows));
  const auto add = [&](const std::string& text) { grid.remark += (grid.remark.empty() ? "" : "; ") + text; };
  if (reading.repeats)
    add(fmt::format("{} the time of the row before",
                    grid.repeated == 1 ? "1 row repeats" : fmt::format("{} rows repeat", grid.repeated)));
  // One or two jumps always fit, and three at random in fewer than one of 100 records.
  constexpr std::size_t kEven = 3;
  const bool even = reading.uniform && reading.uniform->exact();
  if (!reading.no_loss && even && grid.holes.size() + (reading.repeats ? grid.repeated : 0) >= kEven)
    add(
        fmt::format("no loss and a sample time of {:.6g} s is possible too, because the jumps are evenly spaced: "
                    "--interval decides",
                    reading.uniform->interval_ns * 1e-9));
}

}  // namespace

PackedStamps SampleGrid::times_ns(const PackedStamps& stamps) const {
  // Also if the stamps jitter by microseconds: at the ends of seconds, those of Excel days would fall on either side.
  constexpr double kExact_s = 1e-9;
  if (regular && jitter_s < kExact_s && repeated == 0) return stamps;
  PackedStamps times;
  std::int64_t before = 0;
  if (regular && repeated > 0) {  // the grid would be late by each of these rows
    stamps.for_each(0, stamps.size(), [&](std::size_t i, std::int64_t stamp) {
      before = i > 0 ? std::max(stamp, before + 1) : stamp;
      times.push(before);
    });
    return times;
  }
  const double interval_ns = 1e9 * interval_s;
  for (std::size_t h = 0; h <= holes.size(); ++h) {
    const std::size_t begin = h == 0 ? 0 : holes[h - 1].row, end = h == holes.size() ? stamps.size() : holes[h].row;
    if (begin == end) continue;
    // The mean lateness of the run; a drift of the clocks against each other stays within the slope.
    double mean = 0;
    const std::int64_t first = stamps[begin];
    stamps.for_each(begin, end, [&](std::size_t i, std::int64_t stamp) {
      mean += static_cast<double>(stamp - first) - static_cast<double>(i - begin) * interval_ns;
    });
    mean /= static_cast<double>(end - begin);
    for (std::size_t i = begin; i < end; ++i) {
      const std::int64_t time = first + std::llround(mean + static_cast<double>(i - begin) * interval_ns);
      before = i > 0 ? std::max(time, before + 1) : time;
      times.push(before);
    }
  }
  return times;
}

Result<SampleGrid> sample_grid(const Stamps& stamps, const std::string& where, std::optional<double> interval_s) {
  SampleGrid grid;
  if (stamps.size() < 2)
    return make_error(where, fmt::format("found {}, expected 2 or more", counted(stamps.size(), "time")));
  std::size_t earlier = 0;  // the first row that is
  for_each_step(stamps, [&](std::size_t i, std::int64_t step) {
    if (step < 0 && earlier == 0) earlier = i;
    grid.repeated += step == 0;
  });
  if (earlier > 0)
    return make_error(
        fmt::format("{}, row {}", where, earlier + 1),
        fmt::format("found time {:.9g} after {:.9g}, expected increasing times",
                    static_cast<double>(stamps[earlier]) * 1e-9, static_cast<double>(stamps[earlier - 1]) * 1e-9));
  if (stamps.back() == stamps.front()) return make_error(where, "found the same time in all rows");
  grid.mean_step_s =
      1e-9 * static_cast<double>(stamps.back() - stamps.front()) / static_cast<double>(stamps.size() - 1);
  const double median_ns = quantile_of_steps(stamps, 0.5);
  grid.median_step_s = median_ns * 1e-9;
  Reading reading;
  reading.known = interval_s.has_value();
  const auto usual = interval_s ? std::nullopt : step_of_repeating(stamps, median_ns, grid.repeated);
  reading.repeats = usual.has_value();
  reading.guess = interval_s ? FirstGuess{1e9 * *interval_s, 1} : usual ? FirstGuess{*usual, 1} : first_guess(stamps);
  if (!(reading.guess.interval_ns > 0))
    return make_error(where, "found the same time in most rows, expected increasing times");
  find_holes(stamps, reading, grid);
  judge_no_loss(stamps, reading, grid);
  double interval_ns = reading.guess.interval_ns;
  for (const SampleHole& hole : grid.holes) grid.lost += hole.lost;
  std::size_t hole = 0;
  for_each_step(stamps, [&](std::size_t i, std::int64_t step) {
    const bool after_hole = hole < grid.holes.size() && grid.holes[hole].row == i;
    const double count = 1 + (after_hole ? static_cast<double>(grid.holes[hole++].lost) : 0);
    const double off = std::fabs(static_cast<double>(step) - count * interval_ns);
    const bool repeats = reading.repeats && step == 0;
    grid.regular = grid.regular && (repeats || off <= 0.01 * interval_ns || (after_hole && off <= 0.3 * interval_ns));
  });
  grid.jitter_s = 1e-9 * noise_of(stamps, reading.guess);
  // Exact stamps: their own step has more digits than the fit.
  if (!interval_s && grid.regular && quantile_of_steps(stamps, 0.1) == quantile_of_steps(stamps, 0.9))
    interval_ns = median_ns;
  grid.interval_s = interval_ns / 1e9;
  describe(grid, reading, stamps.size());
  return grid;
}

}  // namespace prism::recordings
