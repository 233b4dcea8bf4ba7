// SPDX-License-Identifier: MIT
// Sums over the pairs of adjacent clusters of one record, for one cluster size, as its phase becomes known.
#pragma once

#include <algorithm>
#include <cstddef>

#include "compensation/evaluation/allan_phase.hpp"

namespace prism::evaluation {

/// The phase at consecutive starts, and m and 2 m after them.
template <class Element>
struct PairPhase {
  const Element *begin = nullptr, *middle = nullptr, *end = nullptr;
  std::size_t starts = 0;
};

/// Sums over the differences d of the pairs of a record.
struct PairTotals {
  std::size_t terms = 0;
  double mean = 0;     ///< of d
  double centred = 0;  ///< Σ (d − mean)²
  double squares = 0;  ///< Σ d²
  /// Sums over the pairs of the expected d², in units of that of complete clusters: of quantisation; of B and K.
  double quantisation = 0, slow = 0;
  double at_gaps = 0;  ///< the part of `quantisation` from angle errors at gaps inside of clusters
  /// Overlapping: these errors in bins of bin_values(): number of bins, sum, and sum of squares.
  double bins = 0, bin_errors = 0, bin_squares = 0;
};

/// Values in a bin: most of the errors at a gap are within 64 values, and pairs have their noise in common if they are
/// at most m / 4 apart.
inline std::size_t bin_values(std::size_t m) { return std::clamp<std::size_t>(m / 4, 1, 64); }

/// Starts of pairs that wait for their phase.
class PairStarts {
 public:
  PairStarts(const PhaseRecord& record, std::size_t m, std::size_t step)
      : m_(m), step_(step), all_((record.values - 2 * m) / step + 1) {}

  bool done() const { return added_ == all_; }
  std::size_t m() const { return m_; }
  std::size_t next_start() const { return added_ * step_; }  ///< if not done()

 protected:
  std::size_t m_, step_, all_, added_ = 0;  ///< starts: all, and those that are added
};

/// The second differences of the phase d = x_{j+2m} − 2 x_{j+m} + x_j over all pairs of a record of at least 2 m values
/// without a gap. step: 1, or m for adjacent pairs. The result does not depend on how the phase is divided.
class PairSums : public PairStarts {
 public:
  using Element = double;
  using PairStarts::PairStarts;

  /// Adds the pairs within the first `known` elements of the phase. phase(j, n): PairPhase of the starts j, j + step,
  /// …, of n starts or fewer, but at least one.
  template <class Phase>
  void advance(std::size_t known, Phase&& phase) {
    while (!done() && next_start() + 2 * m_ < known)
      add(phase(next_start(), std::min(all_ - added_, (known - 1 - 2 * m_ - next_start()) / step_ + 1)));
  }

  PairTotals totals() const;  ///< if done()

 private:
  void add(const PairPhase<double>& phase);

  double squares4_[4] = {0, 0, 0, 0}, plain4_[4] = {0, 0, 0, 0};  ///< four sums for instruction-level parallelism
};

/// The same for a record with missing values. Those pairs count whose clusters lack at most `most` values each, and
/// have at least half of their weights. With most > 0, the difference of a pair is m times that of the weighted means
/// of its clusters (LostPhase), scaled to the variance that white noise has in complete clusters. The mean is that of
/// all pairs, with the line through the record in place of each missing value: then only the ends of the record count
/// for it, as without missing values, and a ramp is not blurred by the noise between them.
class LostPairSums : public PairStarts {
 public:
  using Element = LostPhase;
  LostPairSums(const PhaseRecord& record, std::size_t m, std::size_t step, std::size_t most);

  template <class Phase>
  void advance(std::size_t known, Phase&& phase) {  ///< as PairSums
    while (!done() && next_start() + 2 * m_ < known)
      add(phase(next_start(), std::min(all_ - added_, (known - 1 - 2 * m_ - next_start()) / step_ + 1)));
  }

  PairTotals totals() const;

 private:
  void add(const PairPhase<LostPhase>& phase);
  /// quantisation: of a variance of 1 of the angle errors; 6 in complete clusters. at_gaps: part of it.
  void add_difference(double d, double quantisation, double at_gaps, double slow);
  void add_to_bins(const LostPhase& begin);
  void add_weighted(const LostPhase& begin, const LostPhase& middle, const LostPhase& end);
  /// Number of starts from the next one on with the same missing values in each cluster; updates before_.
  std::size_t starts_alike();

  /// Sums of the weights of both clusters, and of their squares.
  struct Weights {
    double first = 0, second = 0, first_square = 0, second_square = 0;
    bool operator==(const Weights&) const = default;
  };
  /// Factors of the sums of both clusters; the scale's square.
  struct Shares {
    double first = 0, second = 0, scale2 = 0;
  };
  Shares shares(const Weights& weights) const;

  const PhaseRecord& record_;
  std::size_t most_;
  Weights weights_;
  Shares shares_;                      ///< of weights_
  std::size_t before_[3] = {0, 0, 0};  ///< missing values before the next start, m and 2 m after it
  double constant_;                    ///< of the line that the phase lacks
  double all_differences_ = 0, differences_ = 0, squares_ = 0, quantisation_ = 0, at_gaps_ = 0, slow_ = 0;
  std::size_t bin_left_ = 0;  ///< starts before the end of the bin
  double bin_begin_ = -1;     ///< sum of the steps at the start of the bin; negative: no bin yet
  double bins_ = 0, bin_errors_ = 0, bin_squares_ = 0;
  std::size_t terms_ = 0;
};

/// Number of pairs of a record, and of those with complete clusters.
struct PairCounts {
  std::size_t all = 0, complete = 0;
};
PairCounts count_pairs(const PhaseRecord& record, std::size_t m, std::size_t step);

}  // namespace prism::evaluation
