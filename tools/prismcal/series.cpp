// SPDX-License-Identifier: MIT
#include "tools/prismcal/series.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "compensation/evaluation/allan.hpp"
#include "compensation/sample.hpp"

namespace prism::recordings {

void append(std::vector<Series>& all, std::int64_t second, double value) {
  if (!std::isfinite(value)) return;
  if (all.empty() || second - all.back().end_s() >= kLongGap_s) all.push_back({second});
  std::vector<double>& values = all.back().values;
  values.resize(static_cast<std::size_t>(second - all.back().start_s), kUnknown);
  values.push_back(value);
}

std::optional<double> value_at(const std::vector<Series>& all, std::int64_t second) {
  const auto at = std::upper_bound(all.begin(), all.end(), second,
                                   [](std::int64_t wanted, const Series& series) { return wanted < series.end_s(); });
  if (at == all.end() || second < at->start_s) return std::nullopt;
  const double value = at->values[static_cast<std::size_t>(second - at->start_s)];
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::vector<double> joined(std::vector<Series> all) {
  if (all.size() == 1) return std::move(all.front().values);
  std::vector<double> values;
  for (Series& series : all) {
    const std::vector<double> more = std::move(series.values);  // a year has 250 MB
    if (!values.empty()) values.push_back(evaluation::kAllanBreak);
    values.insert(values.end(), more.begin(), more.end());
  }
  return values;
}

}  // namespace prism::recordings
