// SPDX-License-Identifier: MIT
#include "compensation/evaluation/rate_steps.hpp"

#include <algorithm>
#include <cmath>

#include "compensation/evaluation/far_runs.hpp"

namespace prism::evaluation {
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
