// SPDX-License-Identifier: MIT
#include "compensation/evaluation/thermal.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace prism::evaluation {
namespace {

struct Mean {
  double sum = 0;
  int count = 0;
  void add(double value) { sum += value, ++count; }
  double value() const { return sum / count; }
};

}  // namespace

const char* thermal_kind_text(ThermalKind kind) {
  constexpr const char* kTexts[] = {"soak", "heating", "cooling"};
  return kTexts[static_cast<std::size_t>(kind)];
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

std::vector<ThermalSegment> thermal_segments(std::span<const ThermalKind> kinds) {
  constexpr std::size_t kFewestBlocks = 3;
  std::vector<ThermalSegment> segments;
  for (std::size_t begin = 0, end = 0; begin < kinds.size(); begin = end) {
    while (end < kinds.size() && kinds[end] == kinds[begin]) ++end;
    if (!segments.empty() && (end - begin < kFewestBlocks || segments.back().kind == kinds[begin])) {
      segments.back().end = end;
    } else {
      segments.push_back({kinds[begin], begin, end});
    }
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
