// SPDX-License-Identifier: MIT
#include "compensation/evaluation/allan_phase.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace prism::evaluation {
namespace {

/// Ends a record: values that are missing at its end are not part of it.
void close(PhaseRecord& record) {
  while (!record.missing.empty() && record.missing.back() + 1 == record.values) {
    record.missing.pop_back();
    --record.values;
  }
  record.missing.shrink_to_fit();
}

}  // namespace

AllanPhase::AllanPhase(const RateSource& rate) : rate_(rate) {
  find_mean();
  find_records();
  if (missing_ == 0) return;
  find_taper();
  weighted_sums_.resize(sums_.size());
  for (PhaseRecord& record : records_) {
    if (record.missing.empty()) continue;
    find_line(record);
    find_weighted_sums(record);
  }
}

void AllanPhase::find_mean() {
  double origin = 0, offsets = 0;
  std::size_t values = 0;
  for_each_rate(rate_, [&](std::size_t, double value) {
    if (!std::isfinite(value)) return;
    if (values++ == 0) origin = value;
    offsets += value - origin;
  });
  if (values > 0) mean_ = origin + offsets / static_cast<double>(values);
}

void AllanPhase::find_records() {
  sums_.reserve(rate_.size / kRatePiece + 2);
  bool inside = false, after_gap = false;
  std::size_t run = 0;
  double sum = 0;
  for_each_rate(rate_, [&](std::size_t i, double value) {
    if (i % kRatePiece == 0) sums_.push_back(sum);
    if (!std::isfinite(value)) {
      gaps_ += !after_gap;
      after_gap = true;
      run = 0;
      if (std::isinf(value)) {
        inside = false;
        return;
      }
      ++missing_;
      if (inside) records_.back().missing.push_back(records_.back().values++);
      return;
    }
    after_gap = false;
    if (!inside) {
      if (!records_.empty()) close(records_.back());
      records_.emplace_back().begin = i;
      sum = 0;
      inside = true;
    }
    sum += value - mean_;
    ++records_.back().values;
    ++values_;
    runs_ += run++ == 0;
    longest_run_ = std::max(longest_run_, run);
  });
  sums_.push_back(sum);
  if (!records_.empty()) close(records_.back());
}

void AllanPhase::find_taper() {
  constexpr std::size_t kLong = 8, kMost = 16;
  /// Differences of neighbouring means of `size` values without a gap, times size.
  struct Differences {
    std::size_t size, terms = 0;
    double sum = 0, squares = 0;
    double variance() const {
      const double n = static_cast<double>(terms), size2 = static_cast<double>(size * size);
      return terms > 1 ? std::max(0.0, squares - sum * sum / n) / (2 * n * size2) : 0;
    }
  };
  Differences of[2] = {{.size = 1}, {.size = kLong}};
  double x[2 * kLong + 1] = {};  // the last elements of the phase, in a ring
  std::size_t run = 0;
  for_each_rate(rate_, [&](std::size_t, double value) {
    if (!std::isfinite(value)) {
      run = 0;
      return;
    }
    const auto at = [&](std::size_t before) -> double& { return x[(run - before) % (2 * kLong + 1)]; };
    ++run;
    at(0) = (run > 1 ? at(1) : 0) + (value - mean_);
    if (run == 1) at(1) = 0;
    for (Differences& d : of) {
      if (run < 2 * d.size) continue;
      const double difference = at(0) - 2 * at(d.size) + at(2 * d.size);
      d.sum += difference;
      d.squares += difference * difference;
      ++d.terms;
    }
  });
  if (of[1].terms < 2) return;
  // Variances 3 q + n and 3 q / 64 + n / 8. Slower noise counts as n.
  const double size = kLong, one = of[0].variance(), n = (size * of[1].variance() - one / size) / (1 - 1 / size);
  if (n >= one) return;
  const double most = kMost, wanted = n > 0 ? std::sqrt((one - n) / n) : most;
  taper_ = static_cast<std::size_t>(std::clamp(wanted, 1.0, most));
}

template <class Visit>
void AllanPhase::walk(const PhaseRecord& record, std::size_t piece, Visit&& visit) const {
  const std::size_t first = std::max(piece * kRatePiece, record.begin),
                    last = std::min((piece + 1) * kRatePiece, record.begin + record.values);
  if (first >= last) return;
  double rates[kRatePiece];
  rate_.read(first, std::span(rates, last - first));
  for (std::size_t k = 0; k < last - first; ++k) visit(first - record.begin + k, rates[k] - mean_);
}

template <class Visit>
LostPhase AllanPhase::walk_weighted(const PhaseRecord& record, std::size_t piece, Visit&& visit) const {
  LostPhase x = piece * kRatePiece <= record.begin ? LostPhase{} : weighted_sums_[piece];
  const std::vector<std::size_t>& missing = record.missing;
  std::size_t next = SIZE_MAX, begin = 0, end = 0;  // number of the next missing value; the run
  float rise = 1;                                   // of the weights, per value
  walk(record, piece, [&](std::size_t i, double value) {
    if (next == SIZE_MAX || (next < missing.size() && missing[next] < i)) {
      if (next == SIZE_MAX)
        next = static_cast<std::size_t>(std::lower_bound(missing.begin(), missing.end(), i) - missing.begin());
      while (next < missing.size() && missing[next] < i) ++next;
      begin = next > 0 ? missing[next - 1] + 1 : 0;
      end = next < missing.size() ? missing[next] : record.values;
      rise = 1 / static_cast<float>(std::clamp<std::size_t>((end - begin) / 2, 1, taper_));
    }
    float weight = std::isfinite(value) ? 1 : 0;
    if (weight > 0 && begin > 0) weight = std::min(weight, rise * static_cast<float>(i - begin + 1));
    if (weight > 0 && end < record.values) weight = std::min(weight, rise * static_cast<float>(end - i));
    x.after = weight;
    if (i == 0) x.before = weight;
    const double step = double{x.after} - x.before;
    x.steps += step * step;
    visit(i, x);
    const double rest = weight > 0 ? value - record.level - record.slope * (static_cast<double>(i) - record.centre) : 0;
    x.plain += rest;
    x.sum += weight * rest;
    x.weight += weight;
    x.square += double{weight} * weight;
    x.before = weight;
  });
  return x;
}

void AllanPhase::find_line(PhaseRecord& record) {
  const double n = static_cast<double>(record.values - record.missing.size());
  const std::size_t first = piece_of(record.begin), last = piece_of(record.begin + record.values);
  const auto for_each_value = [&](auto&& visit) {
    for (std::size_t piece = first; piece <= last; ++piece)
      walk(record, piece, [&](std::size_t i, double value) {
        if (std::isfinite(value)) visit(static_cast<double>(i), value);
      });
  };
  double centre = 0, level = 0, moment = 0, spread = 0;
  for_each_value([&](double i, double) { centre += i / n; });
  for_each_value([&](double i, double value) {
    const double t = i - centre;
    level += value / n;
    moment += t * value;
    spread += t * t;
  });
  record.centre = centre;
  record.level = level;
  record.slope = spread > 0 ? moment / spread : 0;
}

void AllanPhase::find_weighted_sums(const PhaseRecord& record) {
  const std::size_t first = piece_of(record.begin), last = piece_of(record.begin + record.values);
  for (std::size_t piece = first; piece < last; ++piece)
    weighted_sums_[piece + 1] = walk_weighted(record, piece, [](std::size_t, const LostPhase&) {});
}

void AllanPhase::read(const PhaseRecord& record, std::size_t piece, std::span<double, kRatePiece> x) const {
  const std::size_t begin = piece * kRatePiece, end = record.begin + record.values;
  double sum = begin <= record.begin ? 0 : sums_[piece];
  walk(record, piece, [&](std::size_t i, double value) {
    x[record.begin + i - begin] = sum;
    sum += value;
  });
  if (piece_of(end) == piece) x[end - begin] = sum;
}

void AllanPhase::read(const PhaseRecord& record, std::size_t piece, std::span<LostPhase, kRatePiece> x) const {
  const std::size_t begin = piece * kRatePiece, end = record.begin + record.values;
  LostPhase last = walk_weighted(
      record, piece, [&](std::size_t i, const LostPhase& element) { x[record.begin + i - begin] = element; });
  if (piece_of(end) != piece) return;
  last.after = last.before;
  x[end - begin] = last;
}

}  // namespace prism::evaluation
