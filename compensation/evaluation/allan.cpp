// SPDX-License-Identifier: MIT
#include "compensation/evaluation/allan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "compensation/evaluation/allan_pairs.hpp"
#include "compensation/evaluation/allan_phase.hpp"

namespace prism::evaluation {
namespace {

/// Elements of the phase in memory at once: for all clusters of up to a quarter of them in one pass. Larger clusters
/// take a pass each, with a piece of the phase for each of their three positions.
constexpr std::size_t kWindow = 1u << 20;

/// Clusters may lack a quarter of their values if fewer than nine of ten pairs are complete.
std::size_t most_missing(const std::vector<PhaseRecord>& records, std::size_t m, std::size_t step) {
  PairCounts sum;
  for (const PhaseRecord& record : records) {
    const PairCounts counts = count_pairs(record, m, step);
    sum.all += counts.all;
    sum.complete += counts.complete;
  }
  return 10 * sum.complete < 9 * sum.all ? m / 4 : 0;
}

/// Number of adjacent clusters that lack at most `most` values.
std::size_t clusters_of(const PhaseRecord& record, std::size_t m, std::size_t most) {
  std::size_t clusters = record.values / m, at = 0;
  for (std::size_t k = 0; at < record.missing.size() && k < record.values / m; ++k) {
    const std::size_t before = at;
    while (at < record.missing.size() && record.missing[at] < (k + 1) * m) ++at;
    if (at - before > most) --clusters;
  }
  return clusters;
}

/// One position in the phase of a record, with the piece that contains it.
template <class Element>
class PhaseCursor {
 public:
  PhaseCursor(const AllanPhase& phase, const PhaseRecord& record) : phase_(phase), record_(record), x_(kRatePiece) {}

  const Element* at(std::size_t i) {
    const std::size_t position = record_.begin + i, piece = AllanPhase::piece_of(position);
    if (piece != piece_) phase_.read(record_, piece, std::span<Element, kRatePiece>(x_));
    piece_ = piece;
    return x_.data() + position % kRatePiece;
  }
  /// Elements of the piece from i on.
  std::size_t available(std::size_t i) const { return kRatePiece - (record_.begin + i) % kRatePiece; }

 private:
  const AllanPhase& phase_;
  const PhaseRecord& record_;
  std::vector<Element> x_;
  std::size_t piece_ = SIZE_MAX;
};

/// Adds all pairs of small clusters, while a window moves over the phase.
template <class Sums>
void add_in_window(const AllanPhase& phase, const PhaseRecord& record, std::vector<Sums>& sizes) {
  using Element = typename Sums::Element;
  const std::size_t elements = record.values + 1;
  std::vector<Element> x(std::min(elements, kWindow));
  std::size_t begin = 0, known = 0;  // the window has the elements from begin to known
  PhaseCursor<Element> cursor(phase, record);
  while (known < elements) {
    while (known < elements && known - begin < x.size()) {
      const std::size_t count = std::min({cursor.available(known), elements - known, x.size() - (known - begin)});
      std::copy_n(cursor.at(known), count, x.data() + (known - begin));
      known += count;
    }
    std::size_t next = known;
    for (Sums& size : sizes) {
      size.advance(known, [&](std::size_t start, std::size_t starts) {
        const Element* at = x.data() + (start - begin);
        return PairPhase<Element>{at, at + size.m(), at + 2 * size.m(), starts};
      });
      if (!size.done()) next = std::min(next, size.next_start());
    }
    std::copy(x.begin() + static_cast<std::ptrdiff_t>(next - begin),
              x.begin() + static_cast<std::ptrdiff_t>(known - begin), x.begin());
    begin = next;
  }
}

/// Adds all pairs of large clusters.
template <class Sums>
void add_with_cursors(const AllanPhase& phase, const PhaseRecord& record, Sums& size, std::size_t step) {
  using Element = typename Sums::Element;
  PhaseCursor<Element> begin(phase, record), middle(phase, record), end(phase, record);
  size.advance(record.values + 1, [&](std::size_t start, std::size_t starts) {
    const std::size_t m = size.m(),
                      common =
                          std::min({begin.available(start), middle.available(start + m), end.available(start + 2 * m)});
    return PairPhase<Element>{begin.at(start), middle.at(start + m), end.at(start + 2 * m),
                              step == 1 ? std::min(starts, common) : 1};
  });
}

/// The totals of a record for each cluster size; 0 terms for sizes without a pair. most: missing values in a cluster.
template <class Sums, class... Most>
std::vector<PairTotals> totals_of(const AllanPhase& phase, const PhaseRecord& record,
                                  std::span<const std::size_t> cluster_sizes, AllanEstimator estimator,
                                  const Most&... most) {
  std::vector<PairTotals> totals(cluster_sizes.size());
  std::vector<Sums> small;
  std::vector<std::size_t> small_sizes;
  for (std::size_t p = 0; p < cluster_sizes.size(); ++p) {
    const std::size_t m = cluster_sizes[p], step = estimator == AllanEstimator::kOverlapping ? 1 : m;
    if (record.values < 2 * m) continue;
    Sums sums(record, m, step, most[p]...);
    if (m <= kWindow / 4) {
      small.push_back(std::move(sums));
      small_sizes.push_back(p);
    } else {
      add_with_cursors(phase, record, sums, step);
      totals[p] = sums.totals();
    }
  }
  add_in_window(phase, record, small);
  for (std::size_t k = 0; k < small.size(); ++k) totals[small_sizes[k]] = small[k].totals();
  return totals;
}

/// Sums over all records, for one cluster size.
struct PointSums {
  double squares = 0, centred = 0, differences = 0, quantisation = 0, slow = 0;
  double at_gaps = 0, bins = 0, bin_errors = 0, bin_squares = 0;

  void add(const PairTotals& record, AllanPoint& point) {
    const double n = static_cast<double>(record.terms);
    squares += record.squares;
    centred += record.centred;
    differences += n * record.mean;
    quantisation += record.quantisation;
    slow += record.slow;
    at_gaps += record.at_gaps;
    bins += record.bins;
    bin_errors += record.bin_errors;
    bin_squares += record.bin_squares;
    point.terms += record.terms;
  }
  void complete(AllanPoint& point, double values) const {
    const double size = static_cast<double>(point.m), terms = static_cast<double>(point.terms);
    point.deviation = std::sqrt(squares / (2.0 * terms)) / size;
    point.centred_variance = centred / (2.0 * terms) / (size * size);
    point.slope_per_sample = differences / terms / (size * size);
    point.quantisation = quantisation / terms;
    point.slow = slow / terms;
    if (!(bin_errors > 0)) return;
    const double unequal = std::max(0.0, bin_squares * bins / (bin_errors * bin_errors) - 1),
                 all_bins = values / static_cast<double>(bin_values(point.m));
    point.gap_deviation = at_gaps / terms * std::sqrt(2 * unequal / all_bins);
  }
};

std::vector<AllanPoint> measure(const AllanPhase& phase, std::span<const std::size_t> cluster_sizes, double tau0_s,
                                AllanEstimator estimator) {
  std::vector<AllanPoint> points;
  std::vector<PointSums> sums(cluster_sizes.size());
  std::vector<std::size_t> most;  // missing values in a cluster
  for (const std::size_t m : cluster_sizes) {
    points.push_back({.m = m, .tau_s = static_cast<double>(m) * tau0_s});
    most.push_back(most_missing(phase.records(), m, estimator == AllanEstimator::kOverlapping ? 1 : m));
  }
  for (const PhaseRecord& record : phase.records()) {
    const auto totals = record.missing.empty() ? totals_of<PairSums>(phase, record, cluster_sizes, estimator)
                                               : totals_of<LostPairSums>(phase, record, cluster_sizes, estimator, most);
    for (std::size_t p = 0; p < points.size(); ++p) {
      points[p].clusters += clusters_of(record, points[p].m, most[p]);
      if (totals[p].terms > 0) sums[p].add(totals[p], points[p]);
    }
  }
  for (std::size_t p = 0; p < points.size(); ++p) {
    if (points[p].terms > 0) sums[p].complete(points[p], static_cast<double>(phase.values() + phase.missing()));
  }
  std::erase_if(points, [](const AllanPoint& point) { return point.terms == 0; });
  return points;
}

}  // namespace

std::vector<std::size_t> allan_cluster_sizes(AllanGrid grid, std::size_t values) {
  const std::size_t largest = values / 3;
  std::vector<std::size_t> sizes;
  if (grid == AllanGrid::kOctave) {
    for (std::size_t m = 1; m <= largest; m *= 2) sizes.push_back(m);
  } else if (grid == AllanGrid::kDecade) {
    for (std::size_t decade = 1; decade <= largest; decade *= 10) {
      for (const std::size_t digit : {1, 2, 4}) {
        if (digit * decade <= largest) sizes.push_back(digit * decade);
      }
    }
  } else {
    for (int k = 0;; ++k) {
      const auto m = static_cast<std::size_t>(std::llround(std::pow(10.0, k / 15.0)));
      if (m > largest) break;
      if (sizes.empty() || m > sizes.back()) sizes.push_back(m);
    }
  }
  return sizes;
}

Result<AllanCurve> allan_deviation(const RateSource& rate, double tau0_s, std::span<const std::size_t> cluster_sizes,
                                   AllanEstimator estimator, const std::string& where) {
  if (!(tau0_s > 0) || !std::isfinite(tau0_s)) {
    return make_error(where, fmt::format("found a sample interval of {} s, expected a positive number", tau0_s));
  }
  const AllanPhase phase(rate);
  AllanCurve curve{estimator, tau0_s, phase.values(), phase.gaps(), phase.missing(), phase.runs(), {}, {}};
  for (const PhaseRecord& record : phase.records()) curve.records.push_back(record.values);
  if (phase.longest_run() < 3) {
    return make_error(where,
                      fmt::format("found {} values in {} segments without a gap, expected at least 3 in one segment",
                                  phase.values(), phase.runs()));
  }
  if (std::find(cluster_sizes.begin(), cluster_sizes.end(), std::size_t{0}) != cluster_sizes.end())
    return make_error(where, "found a cluster of 0 samples, expected 1 or more");
  curve.points = measure(phase, cluster_sizes, tau0_s, estimator);
  return curve;
}

Result<AllanCurve> allan_deviation(std::span<const double> rate, double tau0_s,
                                   std::span<const std::size_t> cluster_sizes, AllanEstimator estimator,
                                   const std::string& where) {
  return allan_deviation(rate_source(rate), tau0_s, cluster_sizes, estimator, where);
}

}  // namespace prism::evaluation
