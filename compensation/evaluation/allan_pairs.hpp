// SPDX-License-Identifier: MIT
// Sums over the pairs of adjacent clusters of one record, for one cluster size, as its phase becomes known.
#pragma once

#include <algorithm>
#include <cstddef>

#include "compensation/evaluation/allan_phase.hpp"

namespace prism::evaluation {

/// Starts of pairs in which the same values are missing.
struct PairRange {
  std::size_t begin = 0, end = 0;
  std::size_t first = 0, second = 0;  ///< missing in the first cluster, in the second
};

/// The ranges of a record of at least 2 m values, in order. step: 1, or m for adjacent pairs.
class PairRanges {
 public:
  PairRanges(const PhaseRecord& record, std::size_t m, std::size_t step);
  bool next(PairRange& range);

 private:
  const PhaseRecord& record_;
  std::size_t m_, step_, at_ = 0, end_;
  std::size_t before_[3] = {0, 0, 0};  ///< missing values before at, at + m, at + 2 m
};

/// The phase at consecutive starts, and m and 2 m after them.
struct PairPhase {
  const double *begin = nullptr, *middle = nullptr, *end = nullptr;
  std::size_t starts = 0;
};

/// The second differences of the phase d = x_{j+2m} − 2 x_{j+m} + x_j over all pairs whose clusters lack at most `most`
/// values each. Those of incomplete clusters are of their means, times m, scaled to the variance that white noise has
/// in complete clusters. The result does not depend on how the phase is divided.
class PairSums {
 public:
  PairSums(const PhaseRecord& record, std::size_t m, std::size_t step, std::size_t most);

  bool done() const { return done_; }
  std::size_t m() const { return m_; }
  std::size_t next_start() const { return start_; }  ///< if not done()

  /// Adds the pairs within the first `known` elements of the phase. phase(j, n): PairPhase of the starts j, j + step,
  /// …, of n starts or fewer, but at least one.
  template <class Phase>
  void advance(std::size_t known, Phase&& phase) {
    while (!done_ && start_ + 2 * m_ < known) {
      const std::size_t left = std::min((range_.end - 1 - start_) / step_, (known - 1 - 2 * m_ - start_) / step_) + 1;
      add(phase(start_, left));
    }
  }

  double differences() const { return differences_; }
  double squares() const { return squares_; }
  std::size_t terms() const { return terms_; }

 private:
  void add(const PairPhase& phase);
  void add_complete(const PairPhase& phase);
  void add_partial(const PairPhase& phase);
  void open_range();
  void close_range();

  PairRanges ranges_;
  std::size_t m_, step_, most_;
  double constant_;  ///< of the line that the phase lacks
  PairRange range_;
  std::size_t start_ = 0, added_ = 0, in_range_ = 0;  ///< next start; pairs of the range that are added, all of them
  double squares4_[4] = {0, 0, 0, 0}, plain4_[4] = {0, 0, 0, 0};  ///< four sums for instruction-level parallelism
  double differences_ = 0, squares_ = 0;
  std::size_t terms_ = 0;
  bool done_ = false;
};

}  // namespace prism::evaluation
