// SPDX-License-Identifier: MIT
#include "compensation/evaluation/allan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "compensation/evaluation/statistics.hpp"

namespace prism::evaluation {
namespace {

/// The rates between two breaks, as their running sum x: x[0] = 0, x[n] = y_0 + … + y_{n−1}; a missing value adds 0. If
/// there is one, x is that of the residuals of a line: a missing value then does not move the centre of a ramp.
struct Record {
  std::vector<double> x;
  std::vector<std::size_t> missing;  ///< positions of the missing values, in order
  double slope = 0;                  ///< of the line, per sample
  std::size_t values() const { return x.size() - 1; }
};

struct Records {
  std::vector<Record> records;
  std::size_t values = 0, missing = 0, gaps = 0, runs = 0, longest_run = 0;
};

/// Mean of the finite values; 0 without one.
double mean_of(std::span<const double> rate) {
  double origin = 0, offsets = 0;
  std::size_t values = 0;
  for (const double value : rate) {
    if (!std::isfinite(value)) continue;
    if (values++ == 0) origin = value;
    offsets += value - origin;
  }
  return values > 0 ? origin + offsets / static_cast<double>(values) : 0;
}

/// Ends a record: values that are missing at its end are not part of it.
void close(Record& record) {
  while (!record.missing.empty() && record.missing.back() + 1 == record.values()) {
    record.missing.pop_back();
    record.x.pop_back();
  }
  record.x.shrink_to_fit();
}

/// Calls visit(position, value) for each value of a record that is not missing.
template <class Visit>
void for_each_value(const Record& record, Visit&& visit) {
  for (std::size_t i = 0, next = 0; i < record.values(); ++i) {
    if (next < record.missing.size() && record.missing[next] == i) {
      ++next;
    } else {
      visit(i, record.x[i + 1] - record.x[i]);
    }
  }
}

/// Subtracts the least-squares line from the values of a record with missing values.
void remove_line(Record& record) {
  if (record.missing.empty()) return;
  const double n = static_cast<double>(record.values() - record.missing.size());
  double centre = 0, level = 0, moment = 0, spread = 0;
  for_each_value(record, [&](std::size_t i, double) { centre += static_cast<double>(i) / n; });
  for_each_value(record, [&](std::size_t i, double value) {
    const double t = static_cast<double>(i) - centre;
    level += value / n;
    moment += t * value;
    spread += t * t;
  });
  record.slope = spread > 0 ? moment / spread : 0;
  double sum = 0, before = 0;
  for (std::size_t i = 0, next = 0; i < record.values(); ++i) {
    const double value = record.x[i + 1] - before;
    before = record.x[i + 1];
    if (next < record.missing.size() && record.missing[next] == i) {
      ++next;
    } else {
      sum += value - level - record.slope * (static_cast<double>(i) - centre);
    }
    record.x[i + 1] = sum;
  }
}

/// The Allan deviation does not depend on a constant, so the mean is subtracted first: the sums stay small and precise.
Records integrate(std::span<const double> rate) {
  Records result;
  const double mean = mean_of(rate);
  bool inside = false;
  std::size_t run = 0;
  for (std::size_t i = 0; i < rate.size(); ++i) {
    const double value = rate[i];
    if (!std::isfinite(value)) {
      const bool first = i == 0 || std::isfinite(rate[i - 1]);
      result.gaps += first;
      run = 0;
      if (std::isinf(value)) {
        inside = false;
        continue;
      }
      ++result.missing;
      if (!inside) continue;
      Record& record = result.records.back();
      record.missing.push_back(record.values());
      record.x.push_back(record.x.back());
      continue;
    }
    if (!inside) {
      if (!result.records.empty()) close(result.records.back());
      result.records.emplace_back();
      if (result.records.size() == 1) result.records.back().x.reserve(rate.size() + 1);
      result.records.back().x.push_back(0);
      inside = true;
    }
    std::vector<double>& x = result.records.back().x;
    x.push_back(x.back() + (value - mean));
    ++result.values;
    result.runs += run++ == 0;
    result.longest_run = std::max(result.longest_run, run);
  }
  if (!result.records.empty()) close(result.records.back());
  for (Record& record : result.records) remove_line(record);
  return result;
}

/// Sums of the second differences of the phase, and of their squares.
struct Sums {
  double differences = 0, squares = 0;
  std::size_t terms = 0;
};

/// Differences without a missing value, plus a constant; four partial sums for instruction-level parallelism.
Sums complete_differences(const double* x, std::size_t m, std::size_t step, std::size_t terms, double constant) {
  double squares[4] = {0, 0, 0, 0}, plain[4] = {0, 0, 0, 0};
  std::size_t k = 0;
  for (; k + 4 <= terms; k += 4) {
    for (std::size_t lane = 0; lane < 4; ++lane) {
      const double* p = x + (k + lane) * step;
      const double d = p[2 * m] - 2 * p[m] + p[0] + constant;
      plain[lane] += d;
      squares[lane] += d * d;
    }
  }
  for (; k < terms; ++k) {
    const double* p = x + k * step;
    const double d = p[2 * m] - 2 * p[m] + p[0] + constant;
    plain[0] += d;
    squares[0] += d * d;
  }
  return {(plain[0] + plain[1]) + (plain[2] + plain[3]), (squares[0] + squares[1]) + (squares[2] + squares[3]), terms};
}

/// Differences of clusters that lack `first` and `second` of m values: those of their means, times m, scaled to the
/// variance that white noise has in complete clusters.
Sums partial_differences(const double* x, std::size_t m, std::size_t first, std::size_t second, std::size_t terms,
                         double constant) {
  const double size = static_cast<double>(m), share1 = size / (size - static_cast<double>(first)),
               share2 = size / (size - static_cast<double>(second)), scale = std::sqrt(2 / (share1 + share2));
  const double a = scale * share1, b = scale * share2;
  Sums sums{0, 0, terms};
  for (std::size_t k = 0; k < terms; ++k) {
    const double d = b * (x[k + 2 * m] - x[k + m]) - a * (x[k + m] - x[k]) + constant;
    sums.differences += d;
    sums.squares += d * d;
  }
  return sums;
}

/// Calls part(begin, end, missing in the first cluster, in the second) for ranges of starts of a pair in which the
/// missing values are the same.
template <class Part>
void for_each_range(const Record& record, std::size_t m, std::size_t step, Part&& part) {
  const std::vector<std::size_t>& missing = record.missing;
  std::size_t at[3] = {0, 0, 0};  // number of missing values before j, j + m, j + 2 m
  const std::size_t end = record.values() - 2 * m + 1;
  for (std::size_t j = 0; j < end;) {
    std::size_t next = step == 1 ? end : std::min(end, j + 1);
    for (std::size_t k = 0; k < 3; ++k) {
      while (at[k] < missing.size() && missing[at[k]] < j + k * m) ++at[k];
      if (at[k] < missing.size()) next = std::min(next, missing[at[k]] + 1 - k * m);
    }
    part(j, next, at[1] - at[0], at[2] - at[1]);
    j = step == 1 ? next : j + step;
  }
}

/// Clusters may lack a quarter of their values if fewer than nine of ten pairs are complete.
std::size_t most_missing(const Records& records, std::size_t m, std::size_t step) {
  std::size_t complete = 0, all = 0;
  for (const Record& record : records.records) {
    if (record.values() < 2 * m) continue;
    if (record.missing.empty()) {
      const std::size_t pairs = (record.values() - 2 * m) / step + 1;
      complete += pairs;
      all += pairs;
      continue;
    }
    for_each_range(record, m, step, [&](std::size_t begin, std::size_t end, std::size_t first, std::size_t second) {
      all += end - begin;
      if (first + second == 0) complete += end - begin;
    });
  }
  return 10 * complete < 9 * all ? m / 4 : 0;
}

Sums pairs_of(const Record& record, std::size_t m, std::size_t step, std::size_t most) {
  if (record.missing.empty())
    return complete_differences(record.x.data(), m, step, (record.values() - 2 * m) / step + 1, 0);
  const double constant = record.slope * static_cast<double>(m) * static_cast<double>(m);
  Sums sums;
  for_each_range(record, m, step, [&](std::size_t begin, std::size_t end, std::size_t first, std::size_t second) {
    if (std::max(first, second) > most) return;
    const double* x = record.x.data() + begin;
    const Sums part = first + second == 0 ? complete_differences(x, m, 1, end - begin, constant)
                                          : partial_differences(x, m, first, second, end - begin, constant);
    sums.differences += part.differences;
    sums.squares += part.squares;
    sums.terms += part.terms;
  });
  return sums;
}

/// Number of adjacent clusters that lack at most `most` values.
std::size_t clusters_of(const Record& record, std::size_t m, std::size_t most) {
  std::size_t clusters = record.values() / m, at = 0;
  for (std::size_t k = 0; at < record.missing.size() && k < record.values() / m; ++k) {
    const std::size_t before = at;
    while (at < record.missing.size() && record.missing[at] < (k + 1) * m) ++at;
    if (at - before > most) --clusters;
  }
  return clusters;
}

AllanPoint measure(const Records& records, std::size_t m, double tau0_s, AllanEstimator estimator) {
  AllanPoint point;
  point.m = m;
  point.tau_s = static_cast<double>(m) * tau0_s;
  const std::size_t step = estimator == AllanEstimator::kOverlapping ? 1 : m;
  const std::size_t most = most_missing(records, m, step);
  double squares = 0, centred = 0, differences = 0;
  for (const Record& record : records.records) {
    point.clusters += clusters_of(record, m, most);
    if (record.values() < 2 * m) continue;
    const Sums sums = pairs_of(record, m, step, most);
    if (sums.terms == 0) continue;
    squares += sums.squares;
    centred += std::max(0.0, sums.squares - sums.differences * sums.differences / static_cast<double>(sums.terms));
    differences += sums.differences;
    point.terms += sums.terms;
  }
  if (point.terms > 0) {
    const double size = static_cast<double>(m), terms = static_cast<double>(point.terms);
    point.deviation = std::sqrt(squares / (2.0 * terms)) / size;
    point.centred_variance = centred / (2.0 * terms) / (size * size);
    point.slope_per_sample = differences / terms / (size * size);
  }
  return point;
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

Result<AllanCurve> allan_deviation(std::span<const double> rate, double tau0_s,
                                   std::span<const std::size_t> cluster_sizes, AllanEstimator estimator,
                                   const std::string& where) {
  if (!(tau0_s > 0) || !std::isfinite(tau0_s)) {
    return make_error(where, fmt::format("found a sample interval of {} s, expected a positive number", tau0_s));
  }
  const Records records = integrate(rate);
  AllanCurve curve{estimator, tau0_s, records.values, records.gaps, records.missing, records.runs, {}, {}};
  for (const Record& record : records.records) curve.records.push_back(record.values());
  if (records.longest_run < 3) {
    return make_error(where,
                      fmt::format("found {} values in {} segments without a gap, expected at least 3 in one segment",
                                  records.values, records.runs));
  }
  for (const std::size_t m : cluster_sizes) {
    if (m == 0) return make_error(where, "found a cluster of 0 samples, expected 1 or more");
    const AllanPoint point = measure(records, m, tau0_s, estimator);
    if (point.terms > 0) curve.points.push_back(point);
  }
  return curve;
}

}  // namespace prism::evaluation
