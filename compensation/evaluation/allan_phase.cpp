// SPDX-License-Identifier: MIT
#include "compensation/evaluation/allan_phase.hpp"

#include <algorithm>
#include <cmath>

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
  for (PhaseRecord& record : records_) {
    if (!record.missing.empty()) find_line(record);
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
    if (i % kRatePiece == 0) sums_.push_back({sum, 0});
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
  sums_.push_back({sum, 0});
  if (!records_.empty()) close(records_.back());
}

template <class Visit>
AllanPhase::Sums AllanPhase::walk(const PhaseRecord& record, std::size_t piece, Visit&& visit) const {
  const std::size_t first = std::max(piece * kRatePiece, record.begin),
                    last = std::min((piece + 1) * kRatePiece, record.begin + record.values);
  Sums sums = first == record.begin ? Sums{} : sums_[piece];
  if (first >= last) return sums;
  double rates[kRatePiece];
  rate_.read(first, std::span(rates, last - first));
  if (record.missing.empty()) {
    for (std::size_t k = 0; k < last - first; ++k) {
      const double value = rates[k] - mean_;
      visit(first - record.begin + k, sums, value);
      sums.plain += value;
    }
    return sums;
  }
  for (std::size_t k = 0; k < last - first; ++k) {
    const std::size_t i = first - record.begin + k;
    if (!std::isfinite(rates[k])) {
      visit(i, sums, rates[k]);
      continue;
    }
    const double before = sums.plain, after = before + (rates[k] - mean_), value = after - before;
    visit(i, sums, value);
    sums.plain = after;
    sums.residual += value - record.level - record.slope * (static_cast<double>(i) - record.centre);
  }
  return sums;
}

void AllanPhase::find_line(PhaseRecord& record) {
  const double n = static_cast<double>(record.values - record.missing.size());
  const std::size_t first = piece_of(record.begin), last = piece_of(record.begin + record.values);
  const auto for_each_value = [&](auto&& visit) {
    for (std::size_t piece = first; piece <= last; ++piece)
      walk(record, piece, [&](std::size_t i, const Sums&, double value) {
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
  for (std::size_t piece = first; piece < last; ++piece)
    sums_[piece + 1].residual = walk(record, piece, [](std::size_t, const Sums&, double) {}).residual;
}

void AllanPhase::read(const PhaseRecord& record, std::size_t piece, std::span<double, kRatePiece> x) const {
  const std::size_t begin = piece * kRatePiece, end = record.begin + record.values;
  const bool line = !record.missing.empty();
  const Sums sums = walk(record, piece, [&](std::size_t i, const Sums& before, double) {
    x[record.begin + i - begin] = line ? before.residual : before.plain;
  });
  if (piece_of(end) == piece) x[end - begin] = line ? sums.residual : sums.plain;
}

}  // namespace prism::evaluation
