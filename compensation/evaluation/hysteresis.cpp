// SPDX-License-Identifier: MIT
#include "compensation/evaluation/hysteresis.hpp"

#include <fmt/format.h>

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

std::optional<double> sensitivity(std::span<const double> temperature_degc, std::span<const double> bias_deg_per_h,
                                  std::span<const ThermalKind> kinds, ThermalKind wanted) {
  Mean t, b;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (kinds[i] != wanted) continue;
    t.add(temperature_degc[i]);
    b.add(bias_deg_per_h[i]);
  }
  if (t.count < 3) return std::nullopt;
  double tt = 0, tb = 0;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (kinds[i] != wanted) continue;
    const double dt = temperature_degc[i] - t.value();
    tt += dt * dt;
    tb += dt * (bias_deg_per_h[i] - b.value());
  }
  if (!(tt > 0)) return std::nullopt;
  return tb / tt;
}

}  // namespace

Result<Hysteresis> measure_hysteresis(std::span<const double> temperature_degc, std::span<const double> bias_deg_per_h,
                                      std::span<const ThermalKind> kinds, double bin_degc, const std::string& where) {
  if (temperature_degc.size() != kinds.size() || bias_deg_per_h.size() != kinds.size()) {
    return make_error(where, fmt::format("found {} temperatures, {} biases and {} kinds, expected equal numbers",
                                         temperature_degc.size(), bias_deg_per_h.size(), kinds.size()));
  }
  if (!(bin_degc > 0)) return make_error(where, fmt::format("found bins of {} degC, expected more than 0", bin_degc));
  std::map<long, std::pair<Mean, Mean>> bins;  // heating, cooling
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (!std::isfinite(temperature_degc[i]) || !std::isfinite(bias_deg_per_h[i])) {
      return make_error(where, fmt::format("block {} is not finite", i));
    }
    auto& bin = bins[std::lround(std::floor(temperature_degc[i] / bin_degc))];
    if (kinds[i] == ThermalKind::kHeating) bin.first.add(bias_deg_per_h[i]);
    if (kinds[i] == ThermalKind::kCooling) bin.second.add(bias_deg_per_h[i]);
  }
  Hysteresis result;
  result.bin_degc = bin_degc;
  for (const auto& [index, means] : bins) {
    if (means.first.count == 0 || means.second.count == 0) continue;
    const HysteresisBin bin{(static_cast<double>(index) + 0.5) * bin_degc, means.first.value(), means.second.value()};
    const double gap = std::abs(bin.gap_deg_per_h());
    if (gap > result.max_gap_deg_per_h) {
      result.max_gap_deg_per_h = gap;
      result.max_gap_at_degc = bin.temperature_degc;
    }
    result.loop_area_deg_per_h_degc += gap * bin_degc;
    result.bins.push_back(bin);
  }
  result.heating_sensitivity = sensitivity(temperature_degc, bias_deg_per_h, kinds, ThermalKind::kHeating);
  result.cooling_sensitivity = sensitivity(temperature_degc, bias_deg_per_h, kinds, ThermalKind::kCooling);
  return result;
}

}  // namespace prism::evaluation
