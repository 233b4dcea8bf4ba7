// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include "compensation/evaluation/allan_coefficients.hpp"
#include "compensation/evaluation/hysteresis.hpp"
#include "tools/prismcal/analysis/evidence.hpp"

namespace prism::analysis {
namespace {

using report::Cell;
using report::fixed_cell;
using report::general_cell;
using report::percent_cell;
using report::Table;
using report::text_cell;

constexpr double kSoakSlope = evaluation::SegmentSettings{}.soak_slope_degc_per_s;

std::string means_text(const Evidence& evidence) {
  return fmt::format("{} s means, divisor {}", evidence.table->features.length_s,
                     evaluation::divisor_text(evidence.judgement->stability.divisor));
}

std::vector<double> times(const recordings::BlockTable& table) {
  std::vector<double> result;
  for (const compensation::Window& block : table.blocks) result.push_back(static_cast<double>(block.bucket.second));
  return result;
}

std::vector<report::Cell> spread_row(const char* name, const evaluation::Spread& spread) {
  return {report::text_cell(name), report::fixed_cell(spread.mean, 5), report::fixed_cell(spread.sd, 5),
          report::fixed_cell(spread.rms, 5), report::fixed_cell(spread.peak_to_peak, 5)};
}

/// Octave points, their confidence and coefficients of a 1 Hz series.
Result<evaluation::AllanCoefficients> coefficients(const std::vector<double>& seconds, const std::string& where) {
  const auto sizes = evaluation::allan_cluster_sizes(evaluation::AllanGrid::kOctave, seconds.size());
  const auto curve = evaluation::allan_deviation(seconds, 1, sizes, evaluation::AllanEstimator::kOverlapping, where);
  if (!curve) return tl::unexpected(curve.error());
  return evaluation::extract_coefficients(*curve, evaluation::allan_confidence(*curve, seconds, 0.683), where);
}

report::Cell coefficient_cell(const std::optional<evaluation::AllanCoefficient>& coefficient) {
  return coefficient ? report::general_cell(coefficient->value, 4)
                     : report::text_cell("not resolved", report::Mark::kMuted);
}

}  // namespace

report::Table stability_table(const Evidence& evidence) {
  const evaluation::BiasStability& s = evidence.judgement->stability;
  report::Table table{evidence.id + "_stability", "Bias stability on " + evidence.table->name, "", {}, {}};
  table.caption = fmt::format(
      "{}, {} blocks. The floor is what white noise alone gives a mean, from first differences; explained = (before² − "
      "after²) / (before² − floor²): near 100 % no model could do better.",
      means_text(evidence), s.before.count);
  table.columns = {{"", "", false},           {"mean", "deg/h"},    {"1 sigma", "deg/h"}, {"rms", "deg/h"},
                   {"peak to peak", "deg/h"}, {"improvement", "%"}, {"floor", "deg/h"},   {"explained", "%"}};
  auto before = spread_row("before", s.before), after = spread_row("after", s.after);
  before.insert(before.end(), {report::text_cell(""), report::fixed_cell(s.floor_deg_per_h, 5), report::text_cell("")});
  after.insert(after.end(),
               {report::percent_cell(s.improvement), report::text_cell(""), report::percent_cell(s.explained)});
  table.rows = {before, after};
  return table;
}

Result<report::Table> segment_table(const Evidence& evidence) {
  const recordings::BlockTable& data = *evidence.table;
  const auto segments =
      evaluation::cut_thermal_segments(times(data), data.column(compensation::kInputTemperature), {}, data.name);
  if (!segments) return tl::unexpected(segments.error());
  report::Table table{evidence.id + "_segments", "Soaks and ramps of " + data.name, "", {}, {}};
  table.caption = fmt::format("{}. A soak is where the temperature changes by less than {:g} degC/min.",
                              means_text(evidence), 60 * kSoakSlope);
  table.columns = {{"segment", "", false},  {"from", "degC"},          {"to", "degC"},
                   {"length", "h"},         {"mean before", "deg/h"},  {"1 sigma before", "deg/h"},
                   {"mean after", "deg/h"}, {"1 sigma after", "deg/h"}};
  const evaluation::Divisor divisor = evidence.judgement->stability.divisor;
  for (const evaluation::ThermalSegment& segment : *segments) {
    const auto part = [&](const std::vector<double>& values) {
      return evaluation::measure_spread(std::span(values).subspan(segment.begin, segment.size()), divisor, data.name);
    };
    const auto before = part(data.bias_deg_per_h), after = part(evidence.judgement->corrected_deg_per_h);
    const double length_h = static_cast<double>(segment.size()) * data.features.length_s / 3600;
    std::vector<report::Cell> row = {report::text_cell(evaluation::thermal_kind_text(segment.kind)),
                                     report::fixed_cell(segment.first_temperature_degc, 1),
                                     report::fixed_cell(segment.last_temperature_degc, 1),
                                     report::fixed_cell(length_h, 2)};
    for (const auto* spread : {&before, &after}) {
      row.push_back(report::fixed_cell(*spread ? std::optional((*spread)->mean) : std::nullopt, 5));
      row.push_back(report::fixed_cell(*spread ? std::optional((*spread)->sd) : std::nullopt, 5));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

Result<report::Table> hysteresis_table(const Evidence& evidence) {
  const recordings::BlockTable& data = *evidence.table;
  const auto temperature = data.column(compensation::kInputTemperature);
  const auto kinds = evaluation::thermal_kinds(times(data), temperature, kSoakSlope);
  constexpr double kBin = 5;
  report::Table table{evidence.id + "_hysteresis", "Heating against cooling on " + data.name, "", {}, {}};
  table.caption =
      fmt::format("Bias in bins of {:g} degC that the ramps passed both ways; the gap is heating less cooling.", kBin);
  table.columns = {{"", "", false},
                   {"largest gap", "deg/h"},
                   {"at", "degC"},
                   {"loop area", "deg/h degC"},
                   {"sensitivity heating", "1e-3 deg/h/degC"},
                   {"sensitivity cooling", "1e-3 deg/h/degC"}};
  for (const bool after : {false, true}) {
    const auto& bias = after ? evidence.judgement->corrected_deg_per_h : data.bias_deg_per_h;
    const auto loop = evaluation::measure_hysteresis(temperature, bias, kinds, kBin, data.name);
    if (!loop) return tl::unexpected(loop.error());
    if (loop->bins.empty())
      return refuse(data.name, "no temperature was passed both heating and cooling: no hysteresis to measure");
    const auto milli = [](std::optional<double> value) { return value ? std::optional(1e3 * *value) : std::nullopt; };
    table.rows.push_back({report::text_cell(after ? "after" : "before"), report::fixed_cell(loop->max_gap_deg_per_h, 5),
                          report::fixed_cell(loop->max_gap_at_degc, 1),
                          report::fixed_cell(loop->loop_area_deg_per_h_degc, 4),
                          report::fixed_cell(milli(loop->heating_sensitivity), 4),
                          report::fixed_cell(milli(loop->cooling_sensitivity), 4)});
  }
  return table;
}

Result<report::Table> allan_table(const Evidence& evidence) {
  const recordings::BlockTable& data = *evidence.table;
  report::Table table{evidence.id + "_allan", "Allan coefficients on " + data.name, "", {}, {}};
  table.caption =
      "Overlapping estimate of the 1 Hz means. A thermal cycle is not stationary: before compensation the long end is "
      "the chamber's. "
      "Bias instability is stated only where the curve has a plateau (÷ 0.664); the minimum / 0.664 bounds it from "
      "above.";
  table.columns = {{"", "", false},
                   {"quantisation", "arcsec"},
                   {"angle random walk", "deg/√h"},
                   {"bias instability", "deg/h"},
                   {"rate random walk", "(deg/h)/√h"},
                   {"rate ramp", "(deg/h)/h"},
                   {"minimum", "deg/h"},
                   {"at", "s"}};
  for (const bool after : {false, true}) {
    const auto seconds = after ? corrected_seconds(*evidence.judgement, data) : data.second_bias_deg_per_h;
    const auto c = coefficients(seconds, data.name);
    if (!c) return tl::unexpected(c.error());
    table.rows.push_back(
        {report::text_cell(after ? "after" : "before"), coefficient_cell(c->quantisation_arcsec),
         coefficient_cell(c->angle_random_walk_deg_per_sqrt_h), coefficient_cell(c->bias_instability_deg_per_h),
         coefficient_cell(c->rate_random_walk_deg_per_h_sqrt_h), coefficient_cell(c->rate_ramp_deg_per_h_h),
         report::general_cell(c->floor.minimum_deg_per_h, 4), report::general_cell(c->floor.tau_s, 6)});
  }
  return table;
}

std::vector<report::Block> evidence_blocks(const Evidence& evidence) {
  std::vector<report::Block> blocks = {stability_table(evidence)};
  const auto add = [&](auto made) {
    if (made) {
      blocks.push_back(std::move(*made));
    } else {
      blocks.push_back(report::Paragraph{made.error().text(), report::Mark::kMuted});
    }
  };
  blocks.push_back(bias_figure(evidence));
  add(segment_table(evidence));
  blocks.push_back(thermal_figure(evidence));
  add(hysteresis_table(evidence));
  add(allan_figure(evidence));
  add(allan_table(evidence));
  add(residual_figure(evidence));
  if (evidence.weights && evidence.training) blocks.push_back(weights_figure(evidence));
  if (evidence.training) blocks.push_back(domain_figure(evidence));
  return blocks;
}

}  // namespace prism::analysis
