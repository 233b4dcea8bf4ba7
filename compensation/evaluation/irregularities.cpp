// SPDX-License-Identifier: MIT
#include "compensation/evaluation/irregularities.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "compensation/evaluation/statistics.hpp"
#include "compensation/sample.hpp"

namespace prism::evaluation {
namespace {

/// Of a longer series, this number of evenly spaced values is enough.
constexpr std::size_t kEnoughValues = 200'000;
std::size_t stride_of(std::span<const double> values) { return values.size() / kEnoughValues + 1; }

double median_of_some(std::span<const double> values) {
  std::vector<double> some;
  for (std::size_t i = 0; i < values.size(); i += stride_of(values)) some.push_back(values[i]);
  return some.empty() ? 0 : median_of(std::move(some));
}

/// The first and last value may be means of a part of the run and of values next to it.
bool is_constant(std::span<const double> values, std::size_t begin, std::size_t end) {
  if (end - begin > 2) ++begin, --end;
  return std::all_of(values.begin() + static_cast<std::ptrdiff_t>(begin),
                     values.begin() + static_cast<std::ptrdiff_t>(end),
                     [&](double value) { return equal_means(value, values[begin]); });
}

/// Parts of one run touch: a value that is only partly far has a mean of its own.
void add_run(const FarRun& run, std::vector<FarRun>& runs) {
  if (runs.empty() || runs.back().end < run.begin) return runs.push_back(run);
  FarRun& last = runs.back();
  const FarRun& larger = run.end - run.begin > last.end - last.begin ? run : last;
  last = {last.begin, run.end, larger.level, larger.rest};
}

/// A code for "no value".
bool have_one_level(const std::vector<FarRun>& runs) {
  return std::all_of(runs.begin(), runs.end(),
                     [&](const FarRun& run) { return equal_means(run.level, runs[0].level); });
}

class Search {
 public:
  Search(std::span<const double> values, const FarLimits& limits)
      : values_(values), limits_(limits), median_(median_of_some(values)) {}

  std::vector<FarRun> runs() {
    std::vector<FarRun> runs;
    for (std::size_t i = 0; i < values_.size();) {
      const FarRun run = i == 0 || steps(i) ? run_at(i) : FarRun{i, i, 0, 0};
      if (run.end > i) {
        add_run(run, runs);
        if (runs.size() > kFewRuns && !have_one_level(runs)) return {};
        i = run.end;
        continue;
      }
      before_.push_back(values_[i]);
      if (before_.size() > kNear) before_.erase(before_.begin());
      ++i;
    }
    return runs;
  }

 private:
  static constexpr std::size_t kNear = 10, kMostSteps = 16;

  bool steps(std::size_t i) const { return std::fabs(values_[i] - values_[i - 1]) > limits_.far; }
  double near_rest(const FarRun& run) const { return std::max(limits_.far, 0.2 * run.distance()); }
  /// Not the good values between the start and a far run, which may precede more good ones: the other values are at
  /// least half and determine the median.
  bool is_far(const FarRun& run, std::size_t end) const {
    const std::size_t first = run.begin + (end > run.begin + 1 ? 1 : 0);  // the first one may be partly good
    const double start = median_between(values_, first, std::min(end, first + 3));
    return run.distance() > limits_.far && std::fabs(run.rest - median_) < std::fabs(run.level - median_) &&
           std::fabs(start - run.rest) > near_rest(run);
  }
  bool may_be_so_long(const FarRun& run, std::size_t end) const {
    if (end - run.begin <= limits_.longest || run.distance() > limits_.absurd) return true;
    const bool changes =
        std::any_of(before_.begin(), before_.end(), [&](double v) { return !equal_means(v, before_[0]); });
    return limits_.any_constant && (changes || before_.empty()) && is_constant(values_, run.begin, end);
  }
  /// The run that begins at the value; without one, end is begin.
  FarRun run_at(std::size_t begin) const {
    const std::size_t count = values_.size(), most = std::max<std::size_t>(count / 2, 1);
    FarRun run{begin, begin, 0, 0};
    std::size_t tried = 0;
    for (std::size_t j = begin + 1; j <= std::min(count, begin + most) && tried < kMostSteps; ++j) {
      if (j < count && !steps(j)) continue;
      ++tried;
      if (before_.empty() && j == count) break;
      const double after = j < count ? median_between(values_, j, std::min(count, j + kNear)) : kUnknown;
      run.rest = before_.empty() ? after : median_of(before_);
      run.level = median_between(values_, begin, j);
      const bool returns = j == count || std::fabs(after - run.rest) <= near_rest(run);
      const bool leaves = limits_.any_constant && j - begin > 2 && std::fabs(after - run.level) > limits_.far &&
                          is_constant(values_, begin, j);
      if (is_far(run, j) && (returns || leaves) && may_be_so_long(run, j)) {
        run.end = j;
        break;
      }
    }
    return run;
  }

  std::span<const double> values_;
  FarLimits limits_;
  double median_;
  std::vector<double> before_;  ///< the last values that are not far
};

}  // namespace

double median_between(std::span<const double> values, std::size_t begin, std::size_t end) {
  const std::size_t stride = (end - begin) / 21 + 1;
  std::vector<double> some;
  for (std::size_t i = begin; i < end; i += stride) some.push_back(values[i]);
  return median_of(std::move(some));
}

std::vector<FarRun> far_runs(std::span<const double> values, const FarLimits& limits) {
  if (!(limits.far > 0)) return {};
  std::vector<FarRun> runs = Search(values, limits).runs();
  if (!runs.empty() || !(limits.code > 0 && limits.code < limits.far)) return runs;
  FarLimits nearer = limits;
  nearer.far = limits.code;
  runs = Search(values, nearer).runs();
  const bool exact =
      std::all_of(runs.begin(), runs.end(), [&](const FarRun& run) { return is_constant(values, run.begin, run.end); });
  return runs.size() >= 3 && exact && have_one_level(runs) ? runs : std::vector<FarRun>();
}

std::vector<ConstantRun> constant_runs(std::span<const double> values, std::size_t least) {
  constexpr std::size_t kRatio = 50, kRare = 200;
  std::vector<ConstantRun> runs;
  std::map<std::size_t, std::size_t> in_runs;  // values, by the length of their run
  for (std::size_t begin = 0, end = 0; begin < values.size(); begin = end) {
    for (end = begin + 1; end < values.size() && equal_means(values[end], values[begin]);) ++end;
    in_runs[end - begin] += end - begin;
    if (end - begin >= least && end - begin < values.size()) runs.push_back({begin, end, false});
  }
  const std::size_t stride = stride_of(values);
  for (ConstantRun& run : runs) {
    const std::size_t length = run.end - run.begin, others = values.size() - length;
    std::size_t in_short = 0, same = 0;
    for (auto of = in_runs.begin(); of != in_runs.end() && of->first <= length / kRatio; ++of) in_short += of->second;
    if (10 * in_short < 9 * others) continue;
    for (std::size_t i = 0; i < values.size(); i += stride)
      same += (i < run.begin || i >= run.end) && equal_means(values[i], values[run.begin]);
    run.certain = kRare * stride * same <= others;
  }
  return runs;
}

double noise_of_steps(std::span<const double> values) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < values.size(); i += stride_of(values)) {
    if (!equal_means(values[i], values[i - 1])) steps.push_back(std::fabs(values[i] - values[i - 1]));
  }
  return steps.empty() ? 0 : kMadToSd * median_of(std::move(steps)) / std::sqrt(2.0);
}

namespace {

/// Missing blocks that are bridged: drift over them hardly differs from that over one block.
constexpr double kBridged = 2;

/// |difference| between the medians of the `wide` blocks before and after the start of block i; 0 at the ends.
double step_at(std::span<const double> blocks, std::size_t i, std::size_t wide) {
  if (i < wide || i + wide > blocks.size()) return 0;
  return std::abs(median_between(blocks, i, i + wide) - median_between(blocks, i - wide, i));
}

/// A step minus the larger of its neighbours: a temperature ramp has equal steps everywhere and results in 0.
double lone_step(std::span<const double> blocks, std::size_t i, std::size_t wide, std::size_t apart) {
  const double before = i >= apart ? step_at(blocks, i - apart, wide) : 0;
  return step_at(blocks, i, wide) - std::max(before, step_at(blocks, i + apart, wide));
}

/// Largest step that is sharp (between two blocks, or within one) and permanent (medians of three blocks on either
/// side, which one outlier does not change).
Step largest_in_part(std::span<const double> blocks) {
  Step largest;
  for (std::size_t i = 3; i + 3 <= blocks.size(); ++i) {
    const double lasting = lone_step(blocks, i, 3, 6);
    if (lasting <= largest.size) continue;
    if (const double size = std::min(lasting, lone_step(blocks, i, 1, 2)); size > largest.size) largest = {size, i};
  }
  return largest;
}

/// Largest change over `lag` blocks that does not bridge a gap; without such a pair of blocks, of all in one part.
double largest_change(std::span<const double> blocks, const std::vector<std::size_t>& parts, std::size_t lag) {
  double largest = 0, range = 0;
  bool any = false;
  for (std::size_t p = 0; p + 1 < parts.size(); ++p) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (std::size_t i = parts[p]; i + 3 <= parts[p + 1]; ++i) {
      const double here = median_between(blocks, i, i + 3);
      low = std::min(low, here), high = std::max(high, here);
      if (i + lag + 3 > parts[p + 1]) continue;
      largest = std::max(largest, std::fabs(median_between(blocks, i + lag, i + lag + 3) - here));
      any = true;
    }
    if (high > low) range = std::max(range, high - low);
  }
  return any ? largest : range;
}

}  // namespace

std::vector<std::size_t> parts_of(std::span<const double> missing) {
  std::vector<std::size_t> begins = {0};
  for (std::size_t i = 1; i < missing.size(); ++i) {
    if (missing[i] > kBridged) begins.push_back(i);
  }
  begins.push_back(missing.size());
  return begins;
}

Step largest_step(std::span<const double> blocks, const std::vector<std::size_t>& parts) {
  Step largest;
  for (std::size_t p = 0; p + 1 < parts.size(); ++p) {
    const std::size_t count = parts[p + 1] - parts[p];
    if (parts.size() > 2 && count < kEnoughForPart) continue;
    const Step step = largest_in_part(blocks.subspan(parts[p], count));
    if (step.size > largest.size) largest = {step.size, parts[p] + step.block};
  }
  return largest;
}

Step largest_step_at_gaps(std::span<const double> blocks, std::span<const double> missing,
                          const std::vector<std::size_t>& parts, double far) {
  Step largest;
  double rest = 0;
  for (std::size_t p = 1; p + 1 < parts.size(); ++p) {
    const std::size_t i = parts[p];
    if (i - parts[p - 1] < 6 || parts[p + 1] - i < 6) continue;
    const double size = step_at(blocks, i, 3), drift = std::max(step_at(blocks, i - 3, 3), step_at(blocks, i + 3, 3));
    const double unexplained = size - drift * (3 + missing[i]) / 3 - far;
    if (unexplained > rest) rest = unexplained, largest = {size, i};
  }
  if (largest.size == 0) return largest;
  const double elsewhere = largest_change(blocks, parts, static_cast<std::size_t>(3 + missing[largest.block]));
  return largest.size > elsewhere + far ? largest : Step();
}

}  // namespace prism::evaluation
