// SPDX-License-Identifier: MIT
#include "compensation/evaluation/allan_pairs.hpp"

#include <cmath>

namespace prism::evaluation {

PairRanges::PairRanges(const PhaseRecord& record, std::size_t m, std::size_t step)
    : record_(record), m_(m), step_(step), end_(record.values - 2 * m + 1) {}

bool PairRanges::next(PairRange& range) {
  if (at_ >= end_) return false;
  const std::vector<std::size_t>& missing = record_.missing;
  std::size_t next = step_ == 1 || missing.empty() ? end_ : at_ + 1;
  for (std::size_t k = 0; k < 3; ++k) {
    while (before_[k] < missing.size() && missing[before_[k]] < at_ + k * m_) ++before_[k];
    if (before_[k] < missing.size()) next = std::min(next, missing[before_[k]] + 1 - k * m_);
  }
  range = {at_, next, before_[1] - before_[0], before_[2] - before_[1]};
  at_ = step_ == 1 ? next : missing.empty() ? end_ : at_ + step_;
  return true;
}

PairSums::PairSums(const PhaseRecord& record, std::size_t m, std::size_t step, std::size_t most)
    : ranges_(record, m, step),
      m_(m),
      step_(step),
      most_(most),
      constant_(record.slope * static_cast<double>(m) * static_cast<double>(m)) {
  open_range();
}

void PairSums::open_range() {
  do {
    done_ = !ranges_.next(range_);
  } while (!done_ && std::max(range_.first, range_.second) > most_);
  start_ = range_.begin;
  added_ = 0;
  in_range_ = (range_.end - 1 - range_.begin) / step_ + 1;
}

void PairSums::close_range() {
  differences_ += (plain4_[0] + plain4_[1]) + (plain4_[2] + plain4_[3]);
  squares_ += (squares4_[0] + squares4_[1]) + (squares4_[2] + squares4_[3]);
  terms_ += in_range_;
  std::fill_n(plain4_, 4, 0.0);
  std::fill_n(squares4_, 4, 0.0);
}

void PairSums::add(const PairPhase& phase) {
  if (range_.first + range_.second == 0) {
    add_complete(phase);
  } else {
    add_partial(phase);
  }
  added_ += phase.starts;
  start_ += phase.starts * step_;
  if (added_ < in_range_) return;
  close_range();
  open_range();
}

// The sum of a pair is chosen by its number in the range; the last ones, fewer than four, belong to the first sum.
void PairSums::add_complete(const PairPhase& phase) {
  const std::size_t step = step_, fours = in_range_ - in_range_ % 4;
  const double constant = constant_;
  const auto add_to = [&](std::size_t sum, std::size_t k) {
    const double d = phase.end[k * step] - 2 * phase.middle[k * step] + phase.begin[k * step] + constant;
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
      const double d = phase.end[at] - 2 * phase.middle[at] + phase.begin[at] + constant;
      plain[lane] += d;
      squares[lane] += d * d;
    }
  }
  std::copy_n(plain, 4, plain4_);
  std::copy_n(squares, 4, squares4_);
  for (; k < phase.starts; ++k) add_to(added_ + k < fours ? (added_ + k) % 4 : 0, k);
}

void PairSums::add_partial(const PairPhase& phase) {
  const double size = static_cast<double>(m_), share1 = size / (size - static_cast<double>(range_.first)),
               share2 = size / (size - static_cast<double>(range_.second)), scale = std::sqrt(2 / (share1 + share2));
  const double a = scale * share1, b = scale * share2;
  for (std::size_t k = 0; k < phase.starts; ++k) {
    const std::size_t at = k * step_;
    const double d = b * (phase.end[at] - phase.middle[at]) - a * (phase.middle[at] - phase.begin[at]) + constant_;
    plain4_[0] += d;
    squares4_[0] += d * d;
  }
}

}  // namespace prism::evaluation
