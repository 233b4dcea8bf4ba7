// SPDX-License-Identifier: MIT
#include "compensation/evaluation/thermal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace prism::evaluation {
namespace {

ThermalSegment describe(ThermalKind kind, std::size_t begin, std::size_t end,
                        std::span<const double> temperature_degc) {
  double sum = 0;
  for (std::size_t i = begin; i < end; ++i) sum += temperature_degc[i];
  return {kind, begin, end, sum / static_cast<double>(end - begin), temperature_degc[begin], temperature_degc[end - 1]};
}

struct Mean {
  double sum = 0;
  int count = 0;
  void add(double value) { sum += value, ++count; }
  double value() const { return sum / count; }
};

}  // namespace

const char* thermal_kind_text(ThermalKind kind) {
  switch (kind) {
    case ThermalKind::kSoak:
      return "soak";
    case ThermalKind::kHeating:
      return "heating";
    case ThermalKind::kCooling:
      return "cooling";
  }
  return "";
}

std::vector<ThermalKind> thermal_kinds(std::span<const double> time_s, std::span<const double> temperature_degc,
                                       double soak_slope_degc_per_s) {
  std::vector<ThermalKind> kinds;
  const std::size_t count = temperature_degc.size();
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t before = i > 0 ? i - 1 : i, after = std::min(i + 1, count - 1);
    const double span_s = time_s[after] - time_s[before];
    const double slope = span_s > 0 ? (temperature_degc[after] - temperature_degc[before]) / span_s : 0;
    kinds.push_back(std::abs(slope) <= soak_slope_degc_per_s ? ThermalKind::kSoak
                    : slope > 0                              ? ThermalKind::kHeating
                                                             : ThermalKind::kCooling);
  }
  return kinds;
}

Result<std::vector<ThermalSegment>> cut_thermal_segments(std::span<const double> time_s,
                                                         std::span<const double> temperature_degc,
                                                         const ThermalSegmentSettings& settings,
                                                         const std::string& where) {
  const std::size_t count = temperature_degc.size();
  if (count < 2 || time_s.size() != count) {
    return make_error(where,
                      fmt::format("{} times and {} temperatures; expected 2 or more of each", time_s.size(), count));
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (!std::isfinite(temperature_degc[i])) return make_error(where, fmt::format("temperature {} is not finite", i));
    if (i > 0 && !(time_s[i] > time_s[i - 1])) return make_error(where, fmt::format("time {} does not increase", i));
  }
  const auto kinds = thermal_kinds(time_s, temperature_degc, settings.soak_slope_degc_per_s);
  std::vector<ThermalSegment> segments;
  for (std::size_t begin = 0; begin < count;) {
    std::size_t end = begin + 1;
    while (end < count && kinds[end] == kinds[begin]) ++end;
    const bool joins = !segments.empty() && (end - begin < settings.min_blocks || segments.back().kind == kinds[begin]);
    if (joins) begin = segments.back().begin;
    const ThermalKind kind = joins ? segments.back().kind : kinds[begin];
    if (joins) segments.pop_back();
    segments.push_back(describe(kind, begin, end, temperature_degc));
    begin = end;
  }
  return segments;
}

std::optional<double> largest_gap(std::span<const double> temperature_degc, std::span<const double> bias_deg_per_h,
                                  std::span<const ThermalKind> kinds, double bin_degc) {
  std::map<double, std::pair<Mean, Mean>> bins;  // heating, cooling
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (!std::isfinite(temperature_degc[i]) || !std::isfinite(bias_deg_per_h[i])) continue;
    auto& [heating, cooling] = bins[std::floor(temperature_degc[i] / bin_degc)];
    if (kinds[i] == ThermalKind::kHeating) heating.add(bias_deg_per_h[i]);
    if (kinds[i] == ThermalKind::kCooling) cooling.add(bias_deg_per_h[i]);
  }
  std::optional<double> largest;
  for (const auto& [bin, means] : bins) {
    const auto& [heating, cooling] = means;
    if (heating.count > 0 && cooling.count > 0)
      largest = std::max(largest.value_or(0), std::abs(heating.value() - cooling.value()));
  }
  return largest;
}

}  // namespace prism::evaluation
