// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "compensation/evaluation/allan.hpp"
#include "compensation/evaluation/hysteresis.hpp"
#include "tools/prismcal/analysis/allan_text.hpp"
#include "tools/prismcal/analysis/recording_meanings.hpp"
#include "tools/prismcal/analysis/recording_report.hpp"

namespace prism::analysis {
namespace {

using report::Cell, report::fixed_cell, report::general_cell, report::percent_cell, report::Table, report::text_cell;

constexpr double kSoakSlope = evaluation::ThermalSegmentSettings{}.soak_slope_degc_per_s;

std::string means_text(const EvaluatedRecording& recording) {
  return fmt::format("{} s means, divisor {}", recording.table->features.length_s,
                     evaluation::divisor_text(recording.evaluation->stability.divisor));
}

std::vector<double> times(const recordings::BlockTable& table) {
  std::vector<double> result;
  for (std::size_t i = 0; i < table.size(); ++i) result.push_back(static_cast<double>(table.second(i)));
  return result;
}

std::vector<Cell> summary_row(const char* name, const evaluation::SummaryStatistics& summary) {
  return {text_cell(name), fixed_cell(summary.mean, 5), fixed_cell(summary.sd, 5), fixed_cell(summary.rms, 5),
          fixed_cell(summary.peak_to_peak, 5)};
}

Cell coefficient_cell(const evaluation::AllanCoefficient& coefficient) {
  if (coefficient.value) return general_cell(*coefficient.value, 4);
  return text_cell(fmt::format("≤ {:.4g}", coefficient.high), report::Emphasis::kMuted);
}

}  // namespace

Result<evaluation::Hysteresis> measure_loop(const EvaluatedRecording& recording, const std::vector<double>& bias) {
  const recordings::BlockTable& data = *recording.table;
  const auto temperature = data.column(compensation::kInputTemperature);
  const auto kinds = evaluation::thermal_kinds(times(data), temperature, kSoakSlope);
  const auto& kept = *recording.evaluation;
  return evaluation::measure_hysteresis(kept.where_corrected(temperature), kept.where_corrected(bias),
                                        kept.where_corrected(kinds), kHysteresisBin, data.name);
}

Result<evaluation::AllanAnalysis> analyse_seconds(const std::vector<recordings::Series>& seconds,
                                                  const std::string& where) {
  return evaluation::analyse_allan(recordings::joined(seconds), 1, evaluation::AllanGrid::kOctave, where);
}

AllanPair analyse_both(const EvaluatedRecording& recording) {
  const recordings::BlockTable& data = *recording.table;
  return {analyse_seconds(data.seconds, data.name),
          analyse_seconds(recording.evaluation->corrected_seconds_deg_per_h(data), data.name)};
}

namespace {

/// A recording whose errors are larger than the model states, as after another turn-on. Nominal: 95 %.
std::string coverage_text(const ModelEvaluation& evaluated) {
  constexpr double kMuchLess = 0.8;
  const auto share = evaluated.coverage();
  if (!share || *share >= kMuchLess) return "";
  return fmt::format(
      " Only {:.1f} % of the means are within 2 sd of the prediction, expected 95 %: here its sd is too small.",
      100 * *share);
}

/// The improvement to expect in further recordings.
std::string further_text(const ModelEvaluation& evaluated) {
  const auto& interval = evaluated.improvement_interval;
  if (!interval) return "";
  return fmt::format(
      " In another recording of this profile expect {} % (95 % interval, estimated from this recording alone){}.",
      interval_text(interval), interval->holds_zero() ? ": it may also be no improvement" : "");
}

}  // namespace

report::Paragraph result_paragraph(const EvaluatedRecording& recording, const std::string& overlap) {
  const ModelEvaluation& evaluated = *recording.evaluation;
  const evaluation::BiasStability& s = evaluated.stability;
  const std::string sigmas = fmt::format(
      "1 sigma of {} s means is {:.5f} deg/h before and {:.5f} after, their mean {:.5f} before and {:.5f} after",
      recording.table->features.length_s, s.before.sd, s.after.sd, s.before.mean, s.after.mean);
  const std::string outside = fmt::format("{:.1f} % of the means are outside the training range.{}",
                                          evaluated.extrapolated_percent(), coverage_text(evaluated));
  if (!overlap.empty())
    return {fmt::format("{}: not a test: {}. The values show how well the model fits its training data: {}. {}",
                        recording.table->name, overlap, sigmas, outside),
            report::Emphasis::kWarn};
  if (!s.improvement)
    return {fmt::format("{}: {}. {}", recording.table->name, sigmas, outside), report::Emphasis::kNone};
  const bool helps = *s.improvement > 0;
  const auto& interval = evaluated.improvement_interval;
  const bool unsure = interval && interval->holds_zero();
  return {fmt::format("{}: the model {} {:.1f} %{}: {}.{} {}", recording.table->name,
                      helps ? "removes" : "makes the drift larger by", 100 * std::abs(*s.improvement),
                      helps ? " of the drift" : "", sigmas, further_text(evaluated), outside),
          unsure  ? report::Emphasis::kWarn
          : helps ? report::Emphasis::kGood
                  : report::Emphasis::kBad};
}

namespace {

// The floor is an estimate: if the residual is below it, the share exceeds 100 %.
Cell explained_cell(const std::optional<double>& explained) {
  return explained && *explained > 1 ? Cell{"> 100", *explained * 100} : percent_cell(explained);
}

}  // namespace

Table stability_table(const EvaluatedRecording& recording) {
  const evaluation::BiasStability& s = recording.evaluation->stability;
  Table table{recording.id + "_stability", "Bias stability on " + recording.table->name, "", {}, {}};
  table.caption = fmt::format(
      "{}, {} blocks. Floor: 1 sigma of a mean from white noise alone, estimated from first differences. Explained = "
      "(before² − after²) / (before² − floor²): at 100 % only white noise is left; above 100 % the residual is "
      "below the estimated floor. 95 % of further: 95 % prediction interval of the improvement in another recording of "
      "the same profile. With shift: the improvement if the shift of the mean since the training counts as an error, "
      "too.",
      means_text(recording), s.before.count);
  const ModelEvaluation& evaluated = *recording.evaluation;
  const auto left_out = [&](std::size_t blocks, const std::string& why) {
    if (blocks > 0)
      table.caption +=
          fmt::format(" {} more blocks are left out: {}, so prismd publishes no corrected rate.", blocks, why);
  };
  left_out(evaluated.without_input, fmt::format("input {} of the model is unknown", evaluated.missing_input));
  left_out(evaluated.uncorrected - evaluated.without_input, "the model's bias is above the limit");
  if (const std::size_t limited = evaluated.slew_limited; limited > 0) {
    table.caption += fmt::format(
        " In {} blocks the correction changed faster than the slew limit allows: prismd publishes the limited "
        "correction.",
        limited);
  }
  table.columns = {{"", "", false},           {"mean", "deg/h"},    {"1 sigma", "deg/h"}, {"rms", "deg/h"},
                   {"peak to peak", "deg/h"}, {"improvement", "%"}, {"floor", "deg/h"},   {"explained", "%"},
                   {"95 % of further", "%"},  {"with shift", "%"}};
  auto before = summary_row("before", s.before), after = summary_row("after", s.after);
  before.insert(before.end(),
                {text_cell(""), fixed_cell(s.floor_deg_per_h, 5), text_cell(""), text_cell(""), text_cell("")});
  after.insert(after.end(), {percent_cell(s.improvement), text_cell(""), explained_cell(s.explained),
                             text_cell(interval_text(recording.evaluation->improvement_interval)),
                             percent_cell(recording.evaluation->rms_improvement)});
  table.rows = {before, after};
  table.meaning = stability_meaning(s, recording.doubtful);
  return table;
}

Result<Table> segment_table(const EvaluatedRecording& recording) {
  const recordings::BlockTable& data = *recording.table;
  const auto segments =
      evaluation::cut_thermal_segments(times(data), data.column(compensation::kInputTemperature), {}, data.name);
  if (!segments) return tl::unexpected(segments.error());
  Table table{recording.id + "_segments", "Soaks and ramps of " + data.name, "", {}, {}};
  table.caption = fmt::format("{}. Soak: the temperature changes by less than {:g} degC/min.", means_text(recording),
                              60 * kSoakSlope);
  table.columns = {{"segment", "", false},  {"from", "degC"},          {"to", "degC"},
                   {"length", "h"},         {"mean before", "deg/h"},  {"1 sigma before", "deg/h"},
                   {"mean after", "deg/h"}, {"1 sigma after", "deg/h"}};
  const evaluation::Divisor divisor = recording.evaluation->stability.divisor;
  for (const evaluation::ThermalSegment& segment : *segments) {
    const auto part = [&](const std::vector<double>& values) {
      std::vector<double> known;
      for (std::size_t i = segment.begin; i < segment.end; ++i) {
        if (std::isfinite(recording.evaluation->corrected_deg_per_h[i])) known.push_back(values[i]);
      }
      return evaluation::summarise(known, divisor, data.name);
    };
    const auto before = part(data.bias_deg_per_h), after = part(recording.evaluation->corrected_deg_per_h);
    const double length_h = static_cast<double>(segment.size()) * data.features.length_s / 3600;
    std::vector<Cell> row = {text_cell(evaluation::thermal_kind_text(segment.kind)),
                             fixed_cell(segment.first_temperature_degc, 1),
                             fixed_cell(segment.last_temperature_degc, 1), fixed_cell(length_h, 2)};
    for (const auto* summary : {&before, &after}) {
      row.push_back(fixed_cell(*summary ? std::optional((*summary)->mean) : std::nullopt, 5));
      row.push_back(fixed_cell(*summary ? std::optional((*summary)->sd) : std::nullopt, 5));
    }
    table.rows.push_back(std::move(row));
  }
  table.meaning = segments_meaning(
      evaluation::thermal_kinds(times(data), data.column(compensation::kInputTemperature), kSoakSlope),
      data.bias_deg_per_h, recording.evaluation->corrected_deg_per_h, recording.evaluation->extrapolated_percent());
  return table;
}

Result<Table> hysteresis_table(const EvaluatedRecording& recording) {
  const recordings::BlockTable& data = *recording.table;
  Table table{recording.id + "_hysteresis", "Heating against cooling on " + data.name, "", {}, {}};
  table.caption = fmt::format("Bias in bins of {:g} degC with both heating and cooling; gap: heating minus cooling.",
                              kHysteresisBin);
  table.columns = {{"", "", false},
                   {"largest gap", "deg/h"},
                   {"at", "degC"},
                   {"loop area", "deg/h degC"},
                   {"sensitivity heating", "1e-3 deg/h/degC"},
                   {"sensitivity cooling", "1e-3 deg/h/degC"}};
  std::vector<evaluation::Hysteresis> loops;
  for (const bool after : {false, true}) {
    const auto loop = measure_loop(recording, after ? recording.evaluation->corrected_deg_per_h : data.bias_deg_per_h);
    if (!loop) return tl::unexpected(loop.error());
    if (loop->bins.empty())
      return make_error(data.name, "no temperature with both heating and cooling: hysteresis cannot be measured");
    const auto milli = [](std::optional<double> value) { return value ? std::optional(1e3 * *value) : std::nullopt; };
    table.rows.push_back({text_cell(after ? "after" : "before"), fixed_cell(loop->max_gap_deg_per_h, 5),
                          fixed_cell(loop->max_gap_at_degc, 1), fixed_cell(loop->loop_area_deg_per_h_degc, 4),
                          fixed_cell(milli(loop->heating_sensitivity), 4),
                          fixed_cell(milli(loop->cooling_sensitivity), 4)});
    loops.push_back(*loop);
  }
  table.meaning = hysteresis_meaning(loops[0], loops[1], recording.evaluation->knows_slope);
  return table;
}

Result<Table> allan_table(const EvaluatedRecording& recording, const AllanPair& allan) {
  Table table{recording.id + "_allan", "Allan coefficients on " + recording.table->name, "", {}, {}};
  table.caption =
      "Overlapping estimate of the 1 Hz means. A thermal cycle is not stationary: before compensation, long averaging "
      "times show the chamber. ≤: too uncertain for a value; 95 % bound.";
  table.columns = {{"", "", false},
                   {"quantisation", "arcsec"},
                   {"angle random walk", "deg/√h"},
                   {"bias instability", "deg/h"},
                   {"rate random walk", "(deg/h)/√h"},
                   {"rate ramp", "(deg/h)/h"},
                   {"minimum", "deg/h"},
                   {"at", "s"}};
  std::vector<evaluation::AllanCoefficients> found;
  std::string unexplained;
  for (const bool after : {false, true}) {
    const auto& analysis = after ? allan.after : allan.before;
    if (!analysis) return tl::unexpected(analysis.error());
    if (!analysis->coefficients) return tl::unexpected(analysis->coefficients.error());
    std::vector<Cell> row = {text_cell(after ? "after" : "before")};
    for (const evaluation::AllanCoefficient& each : *analysis->coefficients) row.push_back(coefficient_cell(each));
    row.push_back(general_cell(analysis->minimum().deviation, 4));
    row.push_back(general_cell(analysis->minimum().tau_s, 6));
    table.rows.push_back(std::move(row));
    if (const std::string text = unexplained_text(*analysis); !text.empty())
      unexplained += fmt::format(" {}: {}", after ? "After" : "Before", text);
    found.push_back(*analysis->coefficients);
  }
  table.meaning = allan_meaning(found[0], found[1]) + unexplained;
  return table;
}

void add_recording_blocks(const EvaluatedRecording& recording, const std::function<void(report::Block)>& take) {
  const auto add = [&](auto made) {
    if (made) {
      take(std::move(*made));
    } else {
      take(report::Paragraph{made.error().text(), report::Emphasis::kMuted});
    }
  };
  take(stability_table(recording));
  take(bias_figure(recording));
  add(segment_table(recording));
  take(thermal_figure(recording));
  add(hysteresis_table(recording));
  const AllanPair allan = analyse_both(recording);
  add(allan_figure(recording, allan));
  add(allan_table(recording, allan));
  add(residual_figure(recording));
  if (recording.training) take(domain_figure(recording));
}

}  // namespace prism::analysis
