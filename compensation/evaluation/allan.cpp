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
  std::size_t complete = 0, all = 0;
  for (const PhaseRecord& record : records) {
    if (record.values < 2 * m) continue;
    PairRanges ranges(record, m, step);
    for (PairRange range; ranges.next(range);) {
      const std::size_t pairs = (range.end - 1 - range.begin) / step + 1;
      all += pairs;
      if (range.first + range.second == 0) complete += pairs;
    }
  }
  return 10 * complete < 9 * all ? m / 4 : 0;
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
class PhaseCursor {
 public:
  PhaseCursor(const AllanPhase& phase, const PhaseRecord& record) : phase_(phase), record_(record), x_(kRatePiece) {}

  const double* at(std::size_t i) {
    const std::size_t position = record_.begin + i, piece = AllanPhase::piece_of(position);
    if (piece != piece_) phase_.read(record_, piece, std::span<double, kRatePiece>(x_));
    piece_ = piece;
    return x_.data() + position % kRatePiece;
  }
  /// Elements of the piece from i on.
  std::size_t available(std::size_t i) const { return kRatePiece - (record_.begin + i) % kRatePiece; }

 private:
  const AllanPhase& phase_;
  const PhaseRecord& record_;
  std::vector<double> x_;
  std::size_t piece_ = SIZE_MAX;
};

/// Adds all pairs of small clusters, while a window moves over the phase.
void add_in_window(const AllanPhase& phase, const PhaseRecord& record, std::vector<PairSums>& sizes) {
  const std::size_t elements = record.values + 1;
  std::vector<double> x(std::min(elements, kWindow));
  std::size_t begin = 0, known = 0;  // the window has the elements from begin to known
  PhaseCursor cursor(phase, record);
  while (known < elements) {
    while (known < elements && known - begin < x.size()) {
      const std::size_t count = std::min({cursor.available(known), elements - known, x.size() - (known - begin)});
      std::copy_n(cursor.at(known), count, x.data() + (known - begin));
      known += count;
    }
    std::size_t next = known;
    for (PairSums& size : sizes) {
      size.advance(known, [&](std::size_t start, std::size_t starts) {
        const double* at = x.data() + (start - begin);
        return PairPhase{at, at + size.m(), at + 2 * size.m(), starts};
      });
      if (!size.done()) next = std::min(next, size.next_start());
    }
    std::copy(x.begin() + static_cast<std::ptrdiff_t>(next - begin),
              x.begin() + static_cast<std::ptrdiff_t>(known - begin), x.begin());
    begin = next;
  }
}

/// Adds all pairs of large clusters.
void add_with_cursors(const AllanPhase& phase, const PhaseRecord& record, PairSums& size, std::size_t step) {
  PhaseCursor begin(phase, record), middle(phase, record), end(phase, record);
  size.advance(record.values + 1, [&](std::size_t start, std::size_t starts) {
    const std::size_t m = size.m(),
                      common =
                          std::min({begin.available(start), middle.available(start + m), end.available(start + 2 * m)});
    return PairPhase{begin.at(start), middle.at(start + m), end.at(start + 2 * m),
                     step == 1 ? std::min(starts, common) : 1};
  });
}

/// Sums over all records, for one cluster size.
struct PointSums {
  std::size_t most = 0;  ///< missing values in a cluster
  double squares = 0, centred = 0, differences = 0;

  void add(const PairSums& pairs, AllanPoint& point) {
    if (pairs.terms() == 0) return;
    squares += pairs.squares();
    centred +=
        std::max(0.0, pairs.squares() - pairs.differences() * pairs.differences() / static_cast<double>(pairs.terms()));
    differences += pairs.differences();
    point.terms += pairs.terms();
  }
  void complete(AllanPoint& point) const {
    const double size = static_cast<double>(point.m), terms = static_cast<double>(point.terms);
    point.deviation = std::sqrt(squares / (2.0 * terms)) / size;
    point.centred_variance = centred / (2.0 * terms) / (size * size);
    point.slope_per_sample = differences / terms / (size * size);
  }
};

std::vector<AllanPoint> measure(const AllanPhase& phase, std::span<const std::size_t> cluster_sizes, double tau0_s,
                                AllanEstimator estimator) {
  const auto step_of = [&](std::size_t m) { return estimator == AllanEstimator::kOverlapping ? 1 : m; };
  std::vector<AllanPoint> points;
  std::vector<PointSums> sums;
  for (const std::size_t m : cluster_sizes) {
    points.push_back({.m = m, .tau_s = static_cast<double>(m) * tau0_s});
    sums.push_back({.most = most_missing(phase.records(), m, step_of(m))});
  }
  for (const PhaseRecord& record : phase.records()) {
    std::vector<PairSums> small;
    std::vector<std::size_t> small_points;
    for (std::size_t p = 0; p < points.size(); ++p) {
      const std::size_t m = points[p].m;
      points[p].clusters += clusters_of(record, m, sums[p].most);
      if (record.values < 2 * m) continue;
      PairSums pairs(record, m, step_of(m), sums[p].most);
      if (m <= kWindow / 4) {
        small.push_back(std::move(pairs));
        small_points.push_back(p);
      } else {
        add_with_cursors(phase, record, pairs, step_of(m));
        sums[p].add(pairs, points[p]);
      }
    }
    add_in_window(phase, record, small);
    for (std::size_t k = 0; k < small.size(); ++k) sums[small_points[k]].add(small[k], points[small_points[k]]);
  }
  for (std::size_t p = 0; p < points.size(); ++p) {
    if (points[p].terms > 0) sums[p].complete(points[p]);
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
