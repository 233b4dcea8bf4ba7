// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include "base/plain_text.hpp"
#include "compensation/evaluation/drift_fit.hpp"
#include "tools/prismcal/recording_report.hpp"

namespace prism::analysis {
namespace {

using evaluation::Estimate, report::Cell, report::Table;

/// A value and its interval.
using Cells = std::vector<Cell>;

Cells shown(const std::optional<Estimate>& estimate) {
  if (!estimate) return {{"not determined", report::Emphasis::kMuted}, ""};
  constexpr double kRounding = 1e-12;  // of a mean that is 0
  const bool interval = estimate->low < estimate->high;
  return {report::general_cell(std::abs(estimate->value) < kRounding ? 0 : estimate->value, 4),
          interval ? fmt::format("{:.4g} to {:.4g}", estimate->low, estimate->high) : ""};
}

Cells shown(const Result<evaluation::AllanAnalysis>& analysis, evaluation::NoiseType type) {
  if (!analysis || !analysis->coefficients) return shown(std::nullopt);
  const evaluation::AllanCoefficient& found = coefficient(*analysis->coefficients, type);
  if (!found.value) return {{fmt::format("≤ {:.4g}", found.high), report::Emphasis::kMuted}, ""};
  return shown(Estimate{*found.value, found.low, found.high});
}

/// The table and its rows; one or two values in each.
struct Parameters {
  explicit Parameters(const char* columns, const std::string& caption)
      : table{"parameters", "Parameters in the terms of IEEE 647 and 952",
              "Terms and units of IEEE Std 647 and 952; the test is not one of these standards. Intervals hold 95 %, "
              "where not stated otherwise." +
                  caption,
              report::columns(columns)} {}

  void add(const std::string& name, const char* unit, const std::vector<Cells>& values, const std::string& method,
           const std::string& count) {
    table.rows.push_back({name, unit});
    for (const Cells& value : values) table.rows.back().insert(table.rows.back().end(), value.begin(), value.end());
    table.rows.back().insert(table.rows.back().end(), {method, count});
  }
  void not_determined(const std::string& name, const char* unit, const std::string& why) {
    const std::size_t values = (table.columns.size() - 4) / 2;
    add(name, unit, std::vector<Cells>(values, shown(std::nullopt)), why, report::kNothing);
  }
  void add_noises(const std::vector<const Result<evaluation::AllanAnalysis>*>& analyses, const std::string& count) {
    using Type = evaluation::NoiseType;
    constexpr const char* kUnits[] = {"arcsec", "deg/√h", "deg/h", "(deg/h)/√h", "(deg/h)/h"};
    for (const Type type : {Type::kAngleRandomWalk, Type::kBiasInstability, Type::kRateRandomWalk, Type::kRateRamp,
                            Type::kQuantisation}) {
      const auto k = static_cast<std::size_t>(type);
      std::vector<Cells> values;
      for (const auto* analysis : analyses) values.push_back(shown(*analysis, type));
      add(fmt::format("{}, {}", "QNBKR"[k], noise_type_text(type)), kUnits[k], values, "Allan deviation, 68 %; ≤: 95 %",
          count);
    }
  }
  void add_untested() {
    not_determined("scale factor", "", "needs a rate table");
    not_determined("misalignment of the input axis", "", "needs a rate table");
    not_determined("sensitivity to acceleration", "", "needs a dividing head");
    not_determined("sensitivity to magnetic fields", "", "needs a field coil");
  }

  Table table;
};

/// The columns of a run: the time in the middle of a mean, s since its start; the bias, deg/h; its possible causes, the
/// slope in degC/min; then the difference of each thermometer from T in the last second of a block.
enum Column : std::size_t { kElapsed, kBefore, kAfter, kTemperature, kSlope, kDays, kThermometers };

/// From one switch-on to the next, or to the end of the recording.
struct Run {
  bool switched_on = false;
  std::vector<std::vector<double>> columns;
};

std::vector<double> row_of(const EvaluatedRecording& recording, const std::vector<SensorName>& thermometers,
                           std::size_t block, double start_s) {
  const recordings::BlockTable& table = recording.loaded.table;
  const compensation::Window& window = table.blocks[block];
  const double end_s = static_cast<double>(table.second(block)) - start_s;
  std::vector<double> row = {end_s - 0.5 * table.features.length_s,
                             table.bias_deg_per_h[block],
                             recording.evaluation.corrected_deg_per_h[block],
                             window.temperature_degc,
                             60 * window.slope_degc_per_s,
                             recording.hours[block] / 24};
  for (const SensorName& thermometer : thermometers) {
    const std::vector<double>& known = window.second_mean.sensors;
    const std::size_t at = sensor_index(sensors_of_list(window.second_mean.sensor_list), thermometer.name);
    row.push_back(at < known.size() ? known[at] - window.second_mean.temperature_degc : kUnknown);
  }
  return row;
}

/// The blocks with a correction, in means of as many that there are not more than 3000.
std::vector<Run> runs_of(const std::vector<EvaluatedRecording>& recordings,
                         const std::vector<SensorName>& thermometers) {
  constexpr std::size_t kMost = 3000;
  std::size_t blocks = 0;
  for (const EvaluatedRecording& recording : recordings) blocks += recording.loaded.table.size();
  const std::size_t together = (blocks + kMost - 1) / kMost;
  std::vector<Run> runs;
  for (const EvaluatedRecording& recording : recordings) {
    const recordings::BlockTable& table = recording.loaded.table;
    const auto begin = [&, empty = std::vector<std::vector<double>>(kThermometers + thermometers.size())](bool start) {
      if (runs.empty() || !runs.back().columns[0].empty()) runs.push_back({false, empty});
      runs.back().switched_on = start;
    };
    begin(false);
    std::int64_t start_s = table.first_s;
    std::vector<double> sums;
    for (std::size_t block = 0, next = 0, count = 0; block < table.size(); ++block) {
      for (; next < table.starts.size() && table.second(block) >= table.starts[next]; ++next) {
        begin(true);
        start_s = table.starts[next], sums.clear(), count = 0;
      }
      if (!std::isfinite(recording.evaluation.corrected_deg_per_h[block])) continue;
      const std::vector<double> row = row_of(recording, thermometers, block, static_cast<double>(start_s));
      sums.resize(row.size());
      for (std::size_t c = 0; c < row.size(); ++c) sums[c] += row[c];
      if (++count < together) continue;
      for (std::size_t c = 0; c < row.size(); ++c)
        runs.back().columns[c].push_back(std::exchange(sums[c], 0) / static_cast<double>(count));
      count = 0;
    }
  }
  if (runs.back().columns[0].empty()) runs.pop_back();
  return runs;
}

/// The largest span of a column in one run.
double span_of(const std::vector<Run>& runs, std::size_t column) {
  double span = 0;
  for (const Run& run : runs) {
    const auto range = report::Range::of(run.columns[column]);
    span = std::max(span, range.high - range.low);
  }
  return span;
}

std::optional<evaluation::DriftFit> fit_runs(const std::vector<Run>& runs, const std::vector<std::size_t>& causes,
                                             std::size_t bias, double band) {
  std::vector<evaluation::DriftRecord> records;
  for (const Run& run : runs) {
    evaluation::DriftRecord record{{}, {}, std::vector<std::vector<double>>(causes.size()), run.switched_on};
    for (std::size_t i = 0; i < run.columns[kElapsed].size(); ++i) {
      if (!std::ranges::all_of(causes, [&](auto c) { return std::isfinite(run.columns[c][i]); })) continue;
      record.time_s.push_back(run.columns[kElapsed][i]);
      record.bias_deg_per_h.push_back(run.columns[bias][i]);
      for (std::size_t c = 0; c < causes.size(); ++c) record.causes[c].push_back(run.columns[causes[c]][i]);
    }
    if (!record.time_s.empty()) records.push_back(std::move(record));
  }
  return evaluation::fit_drift(records, band);
}

/// The white noise of a block, rounded up to one digit.
double noise_band(const std::vector<EvaluatedRecording>& recordings) {
  double floor = 0;
  for (const EvaluatedRecording& recording : recordings)
    floor = std::max(floor, recording.evaluation.stability.floor_deg_per_h.value_or(0));
  if (!(floor > 0)) return 0.01;
  const double digit = std::pow(10, std::floor(std::log10(floor)));
  return digit * std::ceil(floor / digit);
}

/// One after the other: pooled, with a break between them.
Result<evaluation::AllanAnalysis> pooled_allan(const std::vector<EvaluatedRecording>& recordings, bool after) {
  if (recordings.size() == 1) return recordings[0].allan.of(after);
  std::vector<recordings::Series> all;
  for (const EvaluatedRecording& recording : recordings) {
    auto own = after ? recording.evaluation.corrected_seconds_deg_per_h(recording.loaded.table)
                     : recording.loaded.table.seconds;
    std::move(own.begin(), own.end(), std::back_inserter(all));
  }
  return evaluation::analyse_allan(recordings::joined(std::move(all)), 1, "");
}

}  // namespace

Table parameters_table(const std::vector<EvaluatedRecording>& recordings,
                       std::optional<double> warm_up_band_deg_per_h) {
  const recordings::BlockTable& first = recordings[0].loaded.table;
  std::vector<SensorName> thermometers = sensors_of_list(first.blocks[0].second_mean.sensor_list);
  std::erase_if(thermometers, [](const SensorName& sensor) { return sensor.unit != "degC"; });
  const std::vector<Run> runs = runs_of(recordings, thermometers);
  const double band = warm_up_band_deg_per_h ? *warm_up_band_deg_per_h : noise_band(recordings);
  std::size_t starts = 0, shortest = std::numeric_limits<std::size_t>::max();  // means
  for (const Run& run : runs) {
    starts += run.switched_on;
    if (run.switched_on) shortest = std::min(shortest, run.columns[kElapsed].size());
  }
  const std::string all = fmt::format("{}", recordings.size()), starts_text = counted(starts, "switch-on");
  Parameters made(
      "parameter: | unit: | before | interval: | after | interval: | method: | recordings:",
      fmt::format(" A switch-on is the begin of a session after {} min without data.", recordings::kOff_s / 60));
  // Before and after.
  const auto both = [](const auto& value) {
    return std::vector<Cells>{shown(std::optional<Estimate>(value(false))),
                              shown(std::optional<Estimate>(value(true)))};
  };

  const auto mean = [&](bool after, double evaluation::SummaryStatistics::*member) {
    std::vector<double> values;
    for (const EvaluatedRecording& r : recordings)
      values.push_back((after ? r.evaluation.stability.after : r.evaluation.stability.before).*member);
    return values.size() > 1 ? evaluation::mean_with_interval(values) : Estimate{values[0], values[0], values[0]};
  };
  made.add("bias", "deg/h", both([&](bool after) { return mean(after, &evaluation::SummaryStatistics::mean); }),
           "mean, Student", all);
  double hours = 0;
  const auto turn_on = [&](bool after) {
    std::vector<double> means;
    for (const Run& run : runs) {
      const std::span<const double> bias(run.columns[after ? kAfter : kBefore].data(), run.switched_on ? shortest : 0);
      if (!bias.empty()) means.push_back(evaluation::neumaier_sum(bias) / static_cast<double>(shortest));
      if (!bias.empty()) hours = run.columns[kElapsed][shortest - 1] / 3600;
    }
    return means.size() < 3 ? std::nullopt : std::optional(evaluation::scatter_with_interval(means));
  };
  const auto scatter = both(turn_on);
  made.add("turn-on to turn-on, 1 sigma", "deg/h", scatter,
           starts < 3 ? "needs three switch-ons" : fmt::format("means of the first {:.3g} h, chi-square", hours),
           starts_text);
  made.add(fmt::format("stability of {} s means, 1 sigma", first.features.length_s), "deg/h",
           both([&](bool after) { return mean(after, &evaluation::SummaryStatistics::sd); }),
           "mean, Student; approximate", all);
  const auto before = pooled_allan(recordings, false), after = pooled_allan(recordings, true);
  made.add_noises({&before, &after}, all);

  struct Cause {
    std::size_t column;
    std::string name;
    const char* unit;
    double least_span;
    const char* needs;
  };
  std::vector<Cause> causes = {{kTemperature, "D_T, temperature", "deg/h/°C", 10, "needs 10 °C of change"},
                               {kSlope, "D_dT/dt, its rate", "deg/h/(°C/min)", 0.1, "needs ramps"},
                               {kDays, "trend", "deg/h per day", 7, "needs 7 days"}};
  std::vector<std::size_t> used;
  for (const Cause& cause : causes) {
    if (span_of(runs, cause.column) >= cause.least_span) used.push_back(cause.column);
  }
  for (std::size_t t = 0; t < thermometers.size(); ++t)
    causes.push_back({kThermometers + t, fmt::format("D_∇T, {} − T", thermometers[t].name), "deg/h/°C", 0.5,
                      "needs differences of 0.5 °C"});
  using Fit = std::optional<evaluation::DriftFit>;
  const BeforeAfter<Fit> common{fit_runs(runs, used, kBefore, band), fit_runs(runs, used, kAfter, band)};
  std::vector<std::string> left;
  for (const Cause& cause : causes) {
    if (span_of(runs, cause.column) < cause.least_span) {
      made.not_determined(cause.name, cause.unit, cause.needs);
      continue;
    }
    std::vector<std::size_t> own = used;
    if (cause.column >= kThermometers) own.push_back(cause.column);  // each thermometer by itself
    const BeforeAfter<Fit> fit =
        own == used ? common : BeforeAfter<Fit>{fit_runs(runs, own, kBefore, band), fit_runs(runs, own, kAfter, band)};
    const auto at = static_cast<std::size_t>(std::ranges::find(own, cause.column) - own.begin());
    const auto value = [&](bool corrected) {
      return fit.of(corrected) ? std::optional(fit.of(corrected)->causes[at]) : std::nullopt;
    };
    made.add(cause.name, cause.unit, both(value), "least squares (REML)", all);
    if (const auto rest = value(true); rest && rest->low * rest->high > 0) left.push_back(cause.name);
  }
  if (thermometers.empty())
    made.not_determined("D_∇T, temperature difference", "deg/h/°C", "needs a second thermometer");
  const auto warm_up = [&](bool corrected) {
    return common.of(corrected) ? common.of(corrected)->warm_up_h : std::nullopt;
  };
  made.add(fmt::format("warm-up to within {:g} deg/h", band), "h", both(warm_up),
           starts == 0 ? "needs a switch-on" : "exponential, with T, dT/dt", starts_text);
  const auto gap = [&](bool corrected) -> std::optional<Estimate> {
    std::optional<double> largest;
    for (const EvaluatedRecording& r : recordings) largest = std::max(largest, r.gap_deg_per_h.of(corrected));
    return largest ? std::optional(Estimate{*largest, *largest, *largest}) : std::nullopt;
  };
  made.add("hysteresis, largest gap", "deg/h", both(gap), "heating − cooling, 5 °C bins", all);
  made.add_untested();
  made.table.meaning = left.empty() ? "The correction leaves no sensitivity or trend that these recordings show."
                                    : fmt::format("After the correction still not 0: {}.", fmt::join(left, "; "));
  return std::move(made.table);
}

Table noise_parameters_table(const evaluation::AllanAnalysis& analysis) {
  Parameters made("parameter: | unit: | value | interval: | method: | recordings:", "");
  const Result<evaluation::AllanAnalysis> result = analysis;
  made.add_noises({&result}, "1");
  const auto add = [&](const char* name, const char* unit, const Estimate& estimate, const std::string& method) {
    made.add(name, unit, {shown(estimate)}, method, "1");
  };
  const auto coefficients = analysis.coefficients.value_or(evaluation::AllanCoefficients{});
  if (const auto walk = coefficient(coefficients, evaluation::NoiseType::kAngleRandomWalk).value) {
    const double matlab = evaluation::matlab_rad_per_s_per_sqrt_hz(*walk),
                 one_sided = evaluation::one_sided_deg_per_s_per_sqrt_hz(*walk);
    add("N in MATLAB", "(rad/s)/√Hz", {matlab, matlab, matlab}, "the same N");
    add("√2 N", "(deg/s)/√Hz", {one_sided, one_sided, one_sided}, "one-sided: data sheets, pwelch");
  }
  const evaluation::AllanPoint& least = analysis.minimum();
  const bool last = &least == &analysis.points.back();
  add("Allan minimum", "deg/h", {least.deviation, least.low, least.high},
      fmt::format("at {:g} s, 68 %{}", least.tau_s, last ? "; the last point: a longer record may give less" : ""));
  made.add_untested();
  return std::move(made.table);
}

}  // namespace prism::analysis
