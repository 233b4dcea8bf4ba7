// SPDX-License-Identifier: MIT
#include "compensation/evaluation/allan_pairs.hpp"

#include <cmath>
#include <vector>

namespace prism::evaluation {

PairTotals PairSums::totals() const {
  const double differences = (plain4_[0] + plain4_[1]) + (plain4_[2] + plain4_[3]),
               squares = (squares4_[0] + squares4_[1]) + (squares4_[2] + squares4_[3]), n = static_cast<double>(all_);
  return {all_, differences / n, std::max(0.0, squares - differences * differences / n), squares, n, n};
}

// The sum of a pair is chosen by its number; the last ones, fewer than four, belong to the first sum.
void PairSums::add(const PairPhase<double>& phase) {
  const std::size_t step = step_, fours = all_ - all_ % 4;
  const auto add_to = [&](std::size_t sum, std::size_t k) {
    const double d = phase.end[k * step] - 2 * phase.middle[k * step] + phase.begin[k * step];
    plain4_[sum] += d;
    squares4_[sum] += d * d;
  };
  std::size_t k = 0;
  for (; k < phase.starts && (added_ + k) % 4 != 0; ++k) add_to(added_ + k < fours ? (added_ + k) % 4 : 0, k);
  double plain[4], squares[4];
  std::copy_n(plain4_, 4, plain);
  std::copy_n(squares4_, 4, squares);
  for (; k + 4 <= phase.starts; k += 4) {
    for (std::size_t lane = 0; lane < 4; ++lane) {
      const std::size_t at = (k + lane) * step;
      const double d = phase.end[at] - 2 * phase.middle[at] + phase.begin[at];
      plain[lane] += d;
      squares[lane] += d * d;
    }
  }
  std::copy_n(plain, 4, plain4_);
  std::copy_n(squares, 4, squares4_);
  for (; k < phase.starts; ++k) add_to(added_ + k < fours ? (added_ + k) % 4 : 0, k);
  added_ += phase.starts;
}

LostPairSums::LostPairSums(const PhaseRecord& record, std::size_t m, std::size_t step, std::size_t most)
    : PairStarts(record, m, step),
      record_(record),
      most_(most),
      constant_(record.slope * static_cast<double>(m) * static_cast<double>(m)) {}

std::size_t LostPairSums::starts_alike() {
  const std::vector<std::size_t>& missing = record_.missing;
  const std::size_t start = next_start();
  std::size_t next = all_ * step_;
  for (std::size_t k = 0; k < 3; ++k) {
    while (before_[k] < missing.size() && missing[before_[k]] < start + k * m_) ++before_[k];
    if (before_[k] < missing.size()) next = std::min(next, missing[before_[k]] + 1 - k * m_);
  }
  return step_ == 1 ? next - start : 1;
}

void LostPairSums::add(const PairPhase<LostPhase>& phase) {
  for (std::size_t k = 0; k < phase.starts;) {
    const std::size_t alike = std::min(starts_alike(), phase.starts - k);
    const bool counts = std::max(before_[1] - before_[0], before_[2] - before_[1]) <= most_;
    for (std::size_t i = 0; i < alike; ++i, ++k) {
      const LostPhase &begin = phase.begin[k * step_], &middle = phase.middle[k * step_], &end = phase.end[k * step_];
      all_differences_ += end.sum - 2 * middle.sum + begin.sum;
      if (most_ > 0 && step_ == 1) add_to_bins(begin);
      if (!counts) continue;
      if (most_ == 0 || end.weight - begin.weight == 2 * static_cast<double>(m_)) {
        add_difference(end.plain - 2 * middle.plain + begin.plain, 6, 0, 1);
      } else {
        add_weighted(begin, middle, end);
      }
    }
    added_ += alike;
  }
}

void LostPairSums::add_difference(double d, double quantisation, double at_gaps, double slow) {
  differences_ += d;
  squares_ += d * d;
  quantisation_ += quantisation;
  at_gaps_ += at_gaps;
  slow_ += slow;
  ++terms_;
}

void LostPairSums::add_to_bins(const LostPhase& begin) {
  if (bin_left_ == 0) {
    if (bin_begin_ >= 0) {
      const double errors = begin.steps - bin_begin_;
      ++bins_;
      bin_errors_ += errors;
      bin_squares_ += errors * errors;
    }
    bin_begin_ = begin.steps;
    bin_left_ = bin_values(m_);
  }
  --bin_left_;
}

LostPairSums::Shares LostPairSums::shares(const Weights& weights) const {
  const double size = static_cast<double>(m_), share1 = size / weights.first, share2 = size / weights.second,
               white = share1 * share1 * weights.first_square + share2 * share2 * weights.second_square,
               scale2 = 2 * size / white, scale = std::sqrt(scale2);
  return {scale * share1, scale * share2, scale2};
}

void LostPairSums::add_weighted(const LostPhase& begin, const LostPhase& middle, const LostPhase& end) {
  const Weights weights = {middle.weight - begin.weight, end.weight - middle.weight, middle.square - begin.square,
                           end.square - middle.square};
  if (2 * std::min(weights.first, weights.second) < static_cast<double>(m_)) return;
  if (!(weights == weights_)) shares_ = shares(weights_ = weights);
  const auto& [first, second, scale2] = shares_;
  const double d = second * (end.sum - middle.sum) - first * (middle.sum - begin.sum);
  // An angle error counts with the step of the weights at it.
  const auto square = [](double x) { return x * x; };
  const auto inside = [&](const LostPhase& from, const LostPhase& to) {
    return to.steps - square(double{to.after} - to.before) - from.steps;
  };
  const double at_gaps = square(first) * inside(begin, middle) + square(second) * inside(middle, end),
               at_ends = square(first * begin.after) + square(first * middle.before + second * middle.after) +
                         square(second * end.before);
  add_difference(d, at_ends + at_gaps, at_gaps, scale2);
}

PairTotals LostPairSums::totals() const {
  PairTotals totals;
  if (terms_ == 0) return totals;
  const double n = static_cast<double>(terms_);
  totals.terms = terms_;
  totals.mean = constant_ + all_differences_ / static_cast<double>(all_);
  totals.centred = std::max(0.0, squares_ - differences_ * differences_ / n);
  totals.squares = totals.centred + n * totals.mean * totals.mean;
  totals.quantisation = quantisation_ / 6;
  totals.slow = slow_;
  totals.at_gaps = at_gaps_ / 6;
  totals.bins = bins_;
  totals.bin_errors = bin_errors_;
  totals.bin_squares = bin_squares_;
  return totals;
}

PairCounts count_pairs(const PhaseRecord& record, std::size_t m, std::size_t step) {
  if (record.values < 2 * m) return {};
  PairCounts counts;
  counts.all = (record.values - 2 * m) / step + 1;
  // Starts from `next` on are not yet judged; a missing value is in the pairs that start up to 2 m − 1 before it.
  std::size_t next = 0, broken = 0;
  for (const std::size_t at : record.missing) {
    const std::size_t first = std::max(next, at + 1 > 2 * m ? (at + 1 - 2 * m + step - 1) / step : 0),
                      last = std::min(counts.all, at / step + 1);
    if (last > first) broken += last - first;
    next = std::max(next, last);
  }
  counts.complete = counts.all - broken;
  return counts;
}

}  // namespace prism::evaluation
