// SPDX-License-Identifier: MIT
#include "tools/prismcal/recording_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace prism::analysis {
namespace {

using report::Cell, report::fixed_cell, report::general_cell, report::percent_cell, report::Table;
using report::Figure, report::Ink, report::Panel, report::Series, report::SeriesStyle;

constexpr double kHysteresisBin_degc = 5;
constexpr const char* kTime = "time, h";
constexpr const char* kBias = "bias, deg/h";

// Values.

/// The rms of deviations from the mean in soaks and in ramps, of the blocks that have a corrected value; unknown with
/// fewer than two.
std::array<std::optional<double>, 2> deviations(const std::vector<evaluation::ThermalKind>& kinds,
                                                const std::vector<double>& values,
                                                const std::vector<double>& corrected) {
  std::vector<double> known, of_kind[2];
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(corrected[i])) known.push_back(values[i]);
  }
  const double mean = evaluation::mean_of(known);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(corrected[i]))
      of_kind[kinds[i] != evaluation::ThermalKind::kSoak].push_back((values[i] - mean) * (values[i] - mean));
  }
  const auto rms = [](const std::vector<double>& squares) {
    return squares.size() < 2 ? std::optional<double>() : std::sqrt(evaluation::mean_of(squares));
  };
  return {rms(of_kind[0]), rms(of_kind[1])};
}

/// "1.5 h" or "400 s".
std::string duration_text(double seconds) {
  return seconds < 3600 ? fmt::format("{:.0f} s", seconds) : fmt::format("{:.1f} h", seconds / 3600);
}

std::vector<double> times(const recordings::BlockTable& table) {
  std::vector<double> result;
  for (std::size_t i = 0; i < table.size(); ++i) result.push_back(static_cast<double>(table.second(i)));
  return result;
}

std::optional<double> gap_of(const EvaluatedRecording& recording, const std::vector<double>& bias) {
  const ModelEvaluation& kept = recording.evaluation;
  return evaluation::largest_gap(kept.where_corrected(recording.temperature_degc), kept.where_corrected(bias),
                                 kept.where_corrected(recording.kinds), kHysteresisBin_degc);
}

void analyse_noise(EvaluatedRecording& recording, bool after) {
  const std::string& where = recording.loaded.table.name;
  auto seconds =
      after ? recording.evaluation.corrected_seconds_deg_per_h(recording.loaded.table) : recording.loaded.table.seconds;
  std::vector<double> rate = recordings::joined(std::move(seconds));
  (after ? recording.spectrum.after : recording.spectrum.before) = evaluation::power_spectrum(rate, 1, where);
  (after ? recording.allan.after : recording.allan.before) = evaluation::analyse_allan(std::move(rate), 1, where);
}

std::optional<double> in_percent(std::optional<double> share) {
  return share ? std::optional(100 * *share) : std::nullopt;
}

/// The improvement is printed as 0.0 %.
bool changes_nothing(const evaluation::BiasStability& stability) { return std::abs(*stability.improvement) < 0.0005; }

/// A coefficient after the correction; if it has no value, `bound` returns its bound instead.
std::optional<double> coefficient_after(const EvaluatedRecording& recording, evaluation::NoiseType type, bool bound) {
  const auto& allan = recording.allan.after;
  if (!allan || !allan->coefficients) return std::nullopt;
  const evaluation::AllanCoefficient& found = coefficient(*allan->coefficients, type);
  return found.value || !bound ? found.value : std::optional(found.high);
}

/// The quantities that can have limits. To add one, write its row.
struct Quantity {
  const char *name, *unit;
  std::optional<double> (*value)(const EvaluatedRecording& recording);
  bool (*is_bound)(const EvaluatedRecording& recording) = nullptr;  ///< the value is an upper bound; null: never
};
using Of = const EvaluatedRecording&;
const Quantity kQuantities[] = {
    {"mean_deg_per_h", "deg/h", [](Of r) { return std::optional(r.evaluation.stability.after.mean); }},
    {"bias_stability_deg_per_h", "deg/h", [](Of r) { return std::optional(r.evaluation.stability.after.sd); }},
    {"rms_deg_per_h", "deg/h", [](Of r) { return std::optional(r.evaluation.stability.after.rms); }},
    {"peak_to_peak_deg_per_h", "deg/h", [](Of r) { return std::optional(r.evaluation.stability.after.peak_to_peak); }},
    {"improvement_percent", "%", [](Of r) { return in_percent(r.evaluation.stability.improvement); }},
    {"explained_percent", "%", [](Of r) { return in_percent(r.evaluation.stability.explained); }},
    {"hysteresis_gap_deg_per_h", "deg/h", [](Of r) { return r.gap_deg_per_h.after; }},
    {"angle_random_walk_deg_per_sqrt_h", "deg/√h",
     [](Of r) { return coefficient_after(r, evaluation::NoiseType::kAngleRandomWalk, false); }},
    {"bias_instability_deg_per_h", "deg/h",
     [](Of r) { return coefficient_after(r, evaluation::NoiseType::kBiasInstability, true); },
     [](Of r) { return !coefficient_after(r, evaluation::NoiseType::kBiasInstability, false); }},
    {"extrapolating_percent", "%", [](Of r) { return std::optional(r.evaluation.extrapolated_percent()); }},
    {"uncorrected_percent", "%",
     [](Of r) {
       return std::optional(100 * static_cast<double>(r.evaluation.uncorrected) /
                            static_cast<double>(r.loaded.table.size()));
     }},
    {"within_two_sd_percent", "%", [](Of r) { return in_percent(r.evaluation.coverage()); }}};

// Parts of tables and figures.

std::string means_text(const EvaluatedRecording& recording) {
  return fmt::format("{} s means, divisor {}", recording.loaded.table.features.length_s,
                     evaluation::divisor_text(recording.evaluation.stability.divisor));
}

Panel time_panel(const char* title, const char* unit, std::vector<Series> series) {
  return {title, {kTime}, {unit}, std::move(series)};
}

Series curve(const char* name, Ink ink, const std::vector<double>& x, const std::vector<double>& y,
             SeriesStyle form = SeriesStyle::kLine) {
  return {name, ink, form, x, y};
}

bool has_uhfo(const recordings::BlockTable& table) {
  return std::ranges::any_of(table.blocks, [](const auto& block) { return std::isfinite(block.uhfo_v); });
}

/// The points of (x, y) for which `keep` returns true.
template <class Keep>
Series picked(const char* name, Ink ink, SeriesStyle form, const std::vector<double>& x, const std::vector<double>& y,
              const Keep& keep) {
  Series series{name, ink, form};
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!keep(i)) continue;
    series.x.push_back(x[i]);
    series.y.push_back(y[i]);
  }
  return series;
}

Panel loop_panel(const char* title, const EvaluatedRecording& recording, const std::vector<double>& bias) {
  const std::vector<double>& temperature = recording.temperature_degc;
  const auto of = [&](evaluation::ThermalKind kind) {
    return [&kinds = recording.kinds, kind](std::size_t i) { return kinds[i] == kind; };
  };
  return {
      title,
      {"T, °C"},
      {kBias},
      {picked("soak", Ink::kRaw, SeriesStyle::kPoints, temperature, bias, of(evaluation::ThermalKind::kSoak)),
       picked("heating", Ink::kModel, SeriesStyle::kPoints, temperature, bias, of(evaluation::ThermalKind::kHeating)),
       picked("cooling", Ink::kCorrected, SeriesStyle::kOpenPoints, temperature, bias,
              of(evaluation::ThermalKind::kCooling))}};
}

/// A curve of octave points with its confidence band.
std::vector<Series> allan_series(const evaluation::AllanAnalysis& analysis, const char* name, Ink ink) {
  Series band{"", ink, SeriesStyle::kBand}, line{name, ink, SeriesStyle::kLinePoints};
  for (const evaluation::AllanPoint& point : analysis.points) {
    band.x.push_back(point.tau_s);
    band.y.push_back(point.low);
    band.high.push_back(point.high);
    line.x.push_back(point.tau_s);
    line.y.push_back(point.deviation);
  }
  return {band, line};
}

/// A density, and its lines at their place on the curve.
std::vector<Series> density_series(const evaluation::Spectrum& spectrum, const char* name, Ink ink) {
  Series line{name, ink, SeriesStyle::kLine, spectrum.frequency_hz, spectrum.density};
  Series lines{spectrum.lines.empty() ? "" : "periodic", ink, SeriesStyle::kOpenPoints};
  for (const evaluation::SpectralLine& each : spectrum.lines) {
    const auto next = std::lower_bound(line.x.begin(), line.x.end(), each.frequency_hz);
    lines.x.push_back(each.frequency_hz);
    lines.y.push_back(line.y[static_cast<std::size_t>(std::min(next, line.x.end() - 1) - line.x.begin())]);
  }
  return {line, lines};
}

Panel autocorrelation_panel(const evaluation::Autocorrelation& r) {
  Series lags{"", Ink::kCorrected, SeriesStyle::kLinePoints};
  for (std::size_t lag = 1; lag < r.coefficient.size(); ++lag) {
    lags.x.push_back(static_cast<double>(lag));
    lags.y.push_back(r.coefficient[lag]);
  }
  const std::vector<double> ends = {0.5, static_cast<double>(r.coefficient.size()) - 0.5};
  return {"",
          {"lag, blocks"},
          {"r"},
          {lags, curve("95 % of white noise", Ink::kGuide, ends, {r.band, r.band}),
           curve("", Ink::kGuide, ends, {-r.band, -r.band})}};
}

// The report, in its order.

std::vector<Cell> summary_row(const char* name, const evaluation::SummaryStatistics& summary) {
  return {name, fixed_cell(summary.mean, 5), fixed_cell(summary.sd, 5), fixed_cell(summary.rms, 5),
          fixed_cell(summary.peak_to_peak, 5)};
}

// The floor is an estimate: if the residual is below it, the share exceeds 100 %.
Cell explained_cell(const std::optional<double>& explained) {
  return explained && *explained > 1 ? Cell{"> 100", *explained * 100} : percent_cell(explained);
}

Table stability_table(const EvaluatedRecording& recording) {
  const evaluation::BiasStability& s = recording.evaluation.stability;
  Table table{recording.id + "_stability", "Bias stability on " + recording.loaded.table.name, "", {}};
  table.caption = fmt::format(
      "{}, {} blocks. Floor: 1 sigma of a mean from white noise alone, estimated from first differences. Explained = "
      "(before² − after²) / (before² − floor²): at 100 % only white noise is left; above 100 % the residual is "
      "below the estimated floor. 95 % of further: 95 % prediction interval of the improvement in another recording of "
      "the same profile. With shift: the improvement if the shift of the mean since the training counts as an error, "
      "too.",
      means_text(recording), s.before.count);
  const ModelEvaluation& evaluated = recording.evaluation;
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
  table.columns = report::columns(
      ": | mean [deg/h] | 1 sigma [deg/h] | rms [deg/h] | peak to peak [deg/h] | improvement [%] | floor [deg/h] | "
      "explained [%] | 95 % of further [%] | with shift [%]");
  auto before = summary_row("before", s.before), after = summary_row("after", s.after);
  before.insert(before.end(), {"", fixed_cell(s.floor_deg_per_h, 5), "", "", ""});
  after.insert(after.end(), {percent_cell(s.improvement), "", explained_cell(s.explained),
                             interval_text(evaluated.improvement_interval), percent_cell(evaluated.rms_improvement)});
  table.rows = {before, after};
  table.meaning = stability_meaning(s, !recording.doubts.empty());
  return table;
}

/// The largest deviation that the model leaves.
std::string bias_meaning(const EvaluatedRecording& recording) {
  const std::vector<double>& corrected_deg_per_h = recording.evaluation.corrected_deg_per_h;
  const evaluation::SummaryStatistics& after = recording.evaluation.stability.after;
  double largest = 0;
  std::size_t at = 0;
  for (std::size_t i = 0; i < corrected_deg_per_h.size(); ++i) {
    const double away = std::abs(corrected_deg_per_h[i] - after.mean);
    if (away > largest) largest = away, at = i;
  }
  if (!(after.sd > 0)) return "The corrected bias is constant.";
  return fmt::format(
      "After the correction the largest deviation is {:.4g} deg/h ({:.1f} sigma), {:.1f} h after the start, at {:.1f} "
      "°C.",
      largest, largest / after.sd, recording.hours[at], recording.temperature_degc[at]);
}

Figure bias_figure(const EvaluatedRecording& recording) {
  const recordings::BlockTable& table = recording.loaded.table;
  const ModelEvaluation& evaluated = recording.evaluation;
  const std::vector<double>& hours = recording.hours;
  Figure figure{recording.id + "_bias", "Bias, model and residual on " + table.name,
                fmt::format("{} s means.", table.features.length_s)};
  figure.plot.panel_height = 190;
  figure.plot.panels = {time_panel("(a) bias and model", kBias,
                                   {curve("bias", Ink::kRaw, hours, table.bias_deg_per_h),
                                    curve("model", Ink::kModel, hours, evaluated.predicted_deg_per_h)}),
                        time_panel("(b) before and after", kBias,
                                   {curve("before", Ink::kRaw, hours, table.bias_deg_per_h),
                                    curve("after", Ink::kCorrected, hours, evaluated.corrected_deg_per_h)})};
  if (evaluated.extrapolated > 0) {
    figure.plot.panels[1].series.push_back(picked("outside the training range", Ink::kModel, SeriesStyle::kPoints,
                                                  hours, evaluated.corrected_deg_per_h,
                                                  [&](std::size_t i) { return evaluated.extrapolating[i]; }));
  }
  figure.meaning = bias_meaning(recording);
  return figure;
}

Table segment_table(const EvaluatedRecording& recording) {
  const recordings::BlockTable& data = recording.loaded.table;
  Table table{recording.id + "_segments", "Soaks and ramps of " + data.name, "", {}};
  table.caption = fmt::format("{}. Soak: the temperature changes by less than {:g} degC/min.", means_text(recording),
                              60 * evaluation::kSoakSlope_degc_per_s);
  table.columns = report::columns(
      "segment: | from [degC] | to [degC] | length [h] | mean before [deg/h] | 1 sigma before [deg/h] | mean after "
      "[deg/h] | 1 sigma after [deg/h]");
  const evaluation::Divisor divisor = recording.evaluation.stability.divisor;
  for (const evaluation::ThermalSegment& segment : evaluation::thermal_segments(recording.kinds)) {
    const auto part = [&](const std::vector<double>& values) {
      std::vector<double> known;
      for (std::size_t i = segment.begin; i < segment.end; ++i) {
        if (std::isfinite(recording.evaluation.corrected_deg_per_h[i])) known.push_back(values[i]);
      }
      return evaluation::summarise(known, divisor);
    };
    const auto before = part(data.bias_deg_per_h), after = part(recording.evaluation.corrected_deg_per_h);
    const double length_h = static_cast<double>(segment.size()) * data.features.length_s / 3600;
    std::vector<Cell> row = {evaluation::thermal_kind_text(segment.kind),
                             fixed_cell(recording.temperature_degc[segment.begin], 1),
                             fixed_cell(recording.temperature_degc[segment.end - 1], 1), fixed_cell(length_h, 2)};
    for (const auto* summary : {&before, &after}) {
      row.push_back(fixed_cell(*summary ? std::optional((*summary)->mean) : std::nullopt, 5));
      row.push_back(fixed_cell(*summary ? std::optional((*summary)->sd) : std::nullopt, 5));
    }
    table.rows.push_back(std::move(row));
  }
  table.meaning = segments_meaning(recording.kinds, data.bias_deg_per_h, recording.evaluation.corrected_deg_per_h,
                                   recording.evaluation.extrapolated_percent());
  return table;
}

Figure thermal_figure(const EvaluatedRecording& recording) {
  return {
      recording.id + "_loop", "Bias against temperature on " + recording.loaded.table.name,
      "Means as above; soaks in a light colour.",
      report::Plot{2,
                   320,
                   {loop_panel("(a) before", recording, recording.loaded.table.bias_deg_per_h),
                    loop_panel("(b) after", recording, recording.evaluation.corrected_deg_per_h)}},
      loop_meaning(recording.gap_deg_per_h.before, recording.gap_deg_per_h.after, recording.evaluation.knows_slope)};
}

Result<Figure> allan_figure(const EvaluatedRecording& recording) {
  std::vector<NoiseCurve> curves;
  std::string lines;
  for (const bool after : {false, true}) {
    const auto& allan = recording.allan.of(after);
    const auto& spectrum = recording.spectrum.of(after);
    if (!allan) return tl::unexpected(allan.error());
    curves.push_back(
        {after ? "after" : "before", after ? Ink::kCorrected : Ink::kModel, &*allan, spectrum ? &*spectrum : nullptr});
    if (after && spectrum) lines = " " + lines_text(*spectrum);
    if (const std::string text = unexplained_text(*allan); !text.empty())
      lines += fmt::format(" {}: {}", after ? "After" : "Before", text);
  }
  const auto &before = recording.allan.before->coefficients, &after = recording.allan.after->coefficients;
  if (before && after) lines += " " + allan_meaning(*before, *after);
  report::Plot plot = noise_plot(curves);
  const std::vector<Series>& drawn = plot.panels[0].series;  // each curve is a band and a line
  const std::string meaning = allan_curve_meaning(drawn[1], drawn[3]) + lines;
  return Figure{recording.id + "_allan_curve",
                "Allan deviation and power spectral density on " + recording.loaded.table.name, kNoiseCaption,
                std::move(plot), meaning};
}

Result<Figure> residual_figure(const EvaluatedRecording& recording) {
  const auto residual = recording.evaluation.where_corrected(recording.evaluation.corrected_deg_per_h);
  const auto r = evaluation::autocorrelate(residual, 60);
  if (!r)
    return make_error(recording.loaded.table.name + ", corrected",
                      "no autocorrelation: the values are equal, or fewer than three");
  return Figure{
      recording.id + "_residual",
      "Residual on " + recording.loaded.table.name,
      fmt::format("Autocorrelation of {} s means. 95 % of the lags of white noise are within the dashed lines.",
                  recording.loaded.table.features.length_s),
      {1, 230, {autocorrelation_panel(*r)}},
      residual_meaning(*r, recording.loaded.table.features.length_s)};
}

/// A recording whose errors are larger than the model states: another turn-on, ageing, a missing input, a wrong sd.
/// Within 2 sd are nominally 95 %.
std::string change_text(const ModelEvaluation& evaluated) {
  constexpr double kMuchLess = 0.8, kSlow = 0.5;
  if (!evaluated.change) return "";
  const evaluation::BiasChange& change = *evaluated.change;
  std::string text;
  if (change.per_day)
    text = fmt::format(" The bias drifts by {:+.4f} ± {:.4f} deg/h a day", change.per_day->value, change.per_day->sd);
  if (change.shift) text = fmt::format(" The bias moved by {:.2g} deg/h since the training", *change.shift);
  if (change.within >= kMuchLess) return text.empty() ? "" : text + "; the shape fits.";
  return fmt::format(
      "{} Only {:.1f} % of the means are within 2 sd of the prediction{}, expected 95 %: {}.",
      text + (text.empty() ? "" : "."), 100 * change.within, text.empty() ? "" : " without that",
      change.correlation > kSlow ? "their errors change slowly, as with a missing input" : "here its sd is too small");
}

/// The improvement to expect in further recordings.
std::string further_text(const ModelEvaluation& evaluated) {
  const auto& interval = evaluated.improvement_interval;
  if (!interval) return "";
  return fmt::format(
      " In another recording of this profile expect {} % (95 % interval, estimated from this recording alone){}.",
      interval_text(interval), interval->holds_zero() ? ": it may also be no improvement" : "");
}

/// How far the temperature, its slope and the bias went.
std::string record_meaning(const EvaluatedRecording& recording) {
  const recordings::BlockTable& table = recording.loaded.table;
  const auto t = report::Range::of(recording.temperature_degc), bias = report::Range::of(table.bias_deg_per_h),
             slope = report::Range::of(table.column(compensation::kInputSlope));
  return fmt::format(
      "While the temperature went from {:.1f} to {:.1f} °C, at up to {:.2f} °C/min, the bias changed by {:.4g} deg/h "
      "(noise of a mean included).",
      t.low, t.high, 60 * std::max(std::abs(slope.low), std::abs(slope.high)), bias.high - bias.low);
}

}  // namespace

EvaluatedRecording evaluate_recording(std::string id, recordings::Loaded loaded, ModelEvaluation evaluation) {
  EvaluatedRecording made;
  made.id = std::move(id), made.loaded = std::move(loaded), made.evaluation = std::move(evaluation);
  const recordings::BlockTable& table = made.loaded.table;
  made.hours = table.hours(), made.temperature_degc = table.column(compensation::kInputTemperature);
  made.kinds = evaluation::thermal_kinds(times(table), made.temperature_degc, evaluation::kSoakSlope_degc_per_s);
  made.gap_deg_per_h = {gap_of(made, table.bias_deg_per_h), gap_of(made, made.evaluation.corrected_deg_per_h)};
  for (const bool after : {false, true}) analyse_noise(made, after);
  made.doubts = recording_doubts(table, made.evaluation, made.loaded.recording.questions());
  return made;
}

std::vector<std::string> measured_names() {
  std::vector<std::string> names;
  for (const Quantity& quantity : kQuantities) names.emplace_back(quantity.name);
  return names;
}

std::vector<Measured> measure_all(const EvaluatedRecording& recording) {
  std::vector<Measured> measured;
  for (const Quantity& quantity : kQuantities)
    measured.push_back({quantity.name, quantity.unit, quantity.value(recording),
                        quantity.is_bound != nullptr && quantity.is_bound(recording)});
  return measured;
}

report::Paragraph result_paragraph(const EvaluatedRecording& recording, bool further) {
  const ModelEvaluation& evaluated = recording.evaluation;
  const evaluation::BiasStability& s = evaluated.stability;
  const std::string sigmas = fmt::format(
      "1 sigma of {} s means is {:.5f} deg/h before and {:.5f} after, their mean {:.5f} before and {:.5f} after",
      recording.loaded.table.features.length_s, s.before.sd, s.after.sd, s.before.mean, s.after.mean);
  const std::string outside = fmt::format("{:.1f} % of the means are outside the training range.{}",
                                          evaluated.extrapolated_percent(), change_text(evaluated));
  if (!recording.overlap.empty())
    return {fmt::format("{}: not a test: {}. The values show how well the model fits its training data: {}. {}",
                        recording.loaded.table.name, recording.overlap, sigmas, outside),
            report::Emphasis::kWarn};
  if (!s.improvement)
    return {fmt::format("{}: {}. {}", recording.loaded.table.name, sigmas, outside), report::Emphasis::kNone};
  const bool helps = *s.improvement > 0;
  const double percent = 100 * std::abs(*s.improvement);
  const std::string effect = changes_nothing(s) ? "does not change the drift"
                             : helps            ? fmt::format("removes {:.1f} % of the drift", percent)
                                                : fmt::format("makes the drift larger by {:.1f} %", percent);
  const auto& interval = evaluated.improvement_interval;
  const bool unsure = interval && interval->holds_zero();
  return {fmt::format("{}: the model {}: {}.{} {}", recording.loaded.table.name, effect, sigmas,
                      further ? further_text(evaluated) : "", outside),
          unsure  ? report::Emphasis::kWarn
          : helps ? report::Emphasis::kGood
                  : report::Emphasis::kBad};
}

Figure record_figure(const EvaluatedRecording& recording) {
  const recordings::BlockTable& table = recording.loaded.table;
  const std::vector<double>& hours = recording.hours;
  Figure figure{recording.id + "_record", "The recording " + table.name,
                fmt::format("{} s means.", table.features.length_s)};
  figure.plot.columns = 2, figure.plot.panel_height = 180;
  auto& panels = figure.plot.panels;
  panels.push_back(time_panel("temperature", "T, °C", {curve("", Ink::kModel, hours, recording.temperature_degc)}));
  panels.push_back(time_panel("slope of temperature", "dT/dt, °C/s",
                              {curve("", Ink::kModel, hours, table.column(compensation::kInputSlope))}));
  if (has_uhfo(table)) {
    panels.push_back(time_panel("high-frequency oscillator", "UHFO, V",
                                {curve("", Ink::kModel, hours, table.column(compensation::kInputUhfo))}));
  }
  panels.push_back(time_panel("rate − Earth rate", kBias, {curve("", Ink::kCorrected, hours, table.bias_deg_per_h)}));
  figure.meaning = record_meaning(recording);
  return figure;
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
  take(segment_table(recording));
  if (std::ranges::any_of(recording.kinds, [](auto kind) { return kind != evaluation::ThermalKind::kSoak; }))
    take(thermal_figure(recording));
  add(allan_figure(recording));
  add(residual_figure(recording));
}

report::Plot noise_plot(const std::vector<NoiseCurve>& curves) {
  Panel allan{"(a)", {"averaging time, s", true}, {"Allan deviation, deg/h", true}};
  Panel density{"(b)", {"frequency, Hz", true}, {"density, (deg/h)²/Hz", true}};
  for (const NoiseCurve& each : curves) {
    for (Series& series : allan_series(*each.allan, each.name, each.ink)) allan.series.push_back(std::move(series));
    if (!each.spectrum) continue;
    for (Series& series : density_series(*each.spectrum, each.name, each.ink))
      density.series.push_back(std::move(series));
  }
  return {2, 360, {std::move(allan), std::move(density)}};
}

std::string lines_text(const evaluation::Spectrum& spectrum) {
  if (spectrum.lines.empty()) return "No part of the rate is periodic.";
  std::string text;
  for (const evaluation::SpectralLine& line : spectrum.lines)
    text += fmt::format("{}{:.4g} Hz ({}), amplitude {:.3g} deg/h", text.empty() ? "Periodic: " : "; ",
                        line.frequency_hz, duration_text(1 / line.frequency_hz), line.amplitude);
  return text + ".";
}

std::string unexplained_text(const evaluation::AllanAnalysis& analysis) {
  if (analysis.unexplained_s.empty()) return "";
  return fmt::format(
      "The five noises miss the Allan deviation at {:g} s by more than 4 standard deviations: an oscillation, a "
      "temperature cycle or noise with one time constant. The coefficients do not describe it.",
      fmt::join(analysis.unexplained_s, ", "));
}

std::string stability_meaning(const evaluation::BiasStability& s, bool doubtful) {
  constexpr double kAlmostNoise = 1.1;
  if (!s.improvement) return "The raw bias is constant: there is nothing to remove.";
  if (changes_nothing(s)) return "The model has no use for such recordings: the drift stays the same.";
  if (*s.improvement <= 0)
    return fmt::format("With this model the rate is worse than without: do not use it for such recordings{}.",
                       doubtful ? ", unless the recording is at fault (see the warning)" : "");
  if (!s.floor_deg_per_h || !s.explained) return "The drift is hardly larger than the noise: little can be removed.";
  const double after = s.after.sd, floor = *s.floor_deg_per_h;
  if (after <= kAlmostNoise * floor)
    return fmt::format("What is left is almost only white noise ({:.5f} deg/h): no model could remove much more.",
                       floor);
  return fmt::format(
      "The model removes {:.1f} % of the drift's variance above the white noise ({:.5f} deg/h). The rest, {:.5f} "
      "deg/h, is {:.1f} times that noise: a better recording, more inputs or another model could remove more.",
      100 * std::min(*s.explained, 1.0), floor, after, after / floor);
}

std::string segments_meaning(const std::vector<evaluation::ThermalKind>& kinds,
                             const std::vector<double>& bias_deg_per_h, const std::vector<double>& corrected_deg_per_h,
                             double extrapolated_percent) {
  constexpr double kAlike = 1.25, kFew = 10;
  const auto [soak_before, ramp_before] = deviations(kinds, bias_deg_per_h, corrected_deg_per_h);
  const auto [soak_after, ramp_after] = deviations(kinds, corrected_deg_per_h, corrected_deg_per_h);
  if (!soak_after || !ramp_after)
    return fmt::format("The recording has only {}: it does not show how the model does in {}.",
                       soak_after ? "soaks" : "ramps", soak_after ? "ramps" : "soaks");
  const double soak = *soak_after, ramp = *ramp_after;
  const std::string conclusion =
      soak >= *soak_before && ramp >= *ramp_before ? "the model makes both worse"
      : extrapolated_percent > kFew
          ? fmt::format("{:.0f} % of the recording are outside the training, so this says little of the model",
                        extrapolated_percent)
      : ramp > kAlike * soak ? "the model is weaker while the temperature changes: train with more such ramps"
      : soak > kAlike * ramp ? "the model is weaker at constant temperature: drift in time, which no input shows"
                             : "the model is as good while the temperature changes as at rest";
  return fmt::format(
      "After the correction, deviations from the mean are {:.5f} deg/h (rms) in soaks and {:.5f} in ramps (before: "
      "{:.5f} and {:.5f}): {}.",
      soak, ramp, *soak_before, *ramp_before, conclusion);
}

std::string loop_meaning(std::optional<double> before, std::optional<double> after, bool knows_slope) {
  if (!before || !after) return "No temperature was passed both heating and cooling, so the loop cannot be judged.";
  std::string text = fmt::format(
      "At the same temperature, heating and cooling differ by up to {:.4g} deg/h before and {:.4g} deg/h after",
      *before, *after);
  if (*after < *before) return text + ".";
  return text + (knows_slope ? ", although the model has the slope of temperature as input: in the training they "
                               "differed in another way."
                             : ": the model needs dTdt as input, or a response (train --response).");
}

std::string allan_curve_meaning(const Series& before, const Series& after) {
  constexpr double kVisible = 1.1;
  struct Place {
    double tau_s, before, after;
    double ratio() const { return before / after; }
  };
  std::vector<Place> places;
  for (std::size_t i = 0; i < before.x.size(); ++i) {
    const auto at = std::ranges::find(after.x, before.x[i]);
    if (at != after.x.end())
      places.push_back({before.x[i], before.y[i], after.y[static_cast<std::size_t>(at - after.x.begin())]});
  }
  std::erase_if(places, [](const Place& place) { return !(place.before > 0 && place.after > 0); });
  if (places.empty()) return "";
  double from = 0;  // the first averaging time from which on it helps; 0: none
  for (const Place& place : places) from = place.ratio() <= kVisible ? 0 : from == 0 ? place.tau_s : from;
  const auto change = [](const char* what, const Place& place) {
    return fmt::format("{} at averages of {}: {:.4g} instead of {:.4g} deg/h", what, duration_text(place.tau_s),
                       place.after, place.before);
  };
  const Place &best = *std::ranges::max_element(places, {}, &Place::ratio),
              &worst = *std::ranges::min_element(places, {}, &Place::ratio);
  std::string text;
  if (best.ratio() > kVisible) text = change("The correction helps most", best);
  if (best.ratio() > kVisible && from > places.front().tau_s)
    text += fmt::format("; in averages below {} the noise dominates, which no model removes", duration_text(from));
  if (worst.ratio() * kVisible < 1)
    text += change(text.empty() ? "The correction makes the rate worse, most" : "; it makes it worse, most", worst);
  return text.empty() ? "The correction does not change the Allan deviation visibly: the noise dominates." : text + ".";
}

std::string allan_meaning(const evaluation::AllanCoefficients& before, const evaluation::AllanCoefficients& after) {
  constexpr double kSame = 0.05;
  const auto &n1 = coefficient(before, evaluation::NoiseType::kAngleRandomWalk).value,
             &n2 = coefficient(after, evaluation::NoiseType::kAngleRandomWalk).value;
  std::string text = "The angle random walk is not determined";
  if (n1 && n2) {
    const double change = *n2 / *n1 - 1;
    text = std::abs(change) <= kSame ? "The model adds no noise: the angle random walk stays the same"
                                     : fmt::format("The angle random walk {} by {:.0f} %",
                                                   change > 0 ? "rises" : "falls", 100 * std::abs(change));
  }
  const auto &b1 = coefficient(before, evaluation::NoiseType::kBiasInstability),
             &b2 = coefficient(after, evaluation::NoiseType::kBiasInstability);
  if (b1.value && b2.value)
    return text + fmt::format("; the bias instability changes from {:.3g} to {:.3g} deg/h.", *b1.value, *b2.value);
  if (b2.value)
    return text + fmt::format("; the bias instability of {:.3g} deg/h was there before, hidden by the thermal drift.",
                              *b2.value);
  return text + fmt::format("; the bias instability after the correction is at most {:.3g} deg/h.", b2.high);
}

std::string residual_meaning(const evaluation::Autocorrelation& residual, int block_s) {
  // Of the lags of white noise, 5 % are outside the band; twice that is hardly chance.
  constexpr double kByChance = 0.1;
  const std::vector<double>& r = residual.coefficient;
  const auto inside = [&](double value) { return std::abs(value) <= residual.band; };
  const auto outside = r.size() - 1 - static_cast<std::size_t>(std::count_if(r.begin() + 1, r.end(), inside));
  if (static_cast<double>(outside) <= kByChance * static_cast<double>(r.size() - 1))
    return fmt::format(
        "{} of {} lags are outside the lines, as with white noise: nothing is left that a model could "
        "remove.",
        outside, r.size() - 1);
  const auto end = std::find_if(r.begin() + 1, r.end(), inside);
  const double lags = static_cast<double>((end == r.end() ? r.end() - 1 : end) - r.begin());
  // White noise has no correlation with the next block, so the first coefficient is the drift's share.
  return fmt::format(
      "{} of {} lags are outside the lines: {} the residual is a drift that changes over {} {}, which the "
      "inputs do not show.",
      outside, r.size() - 1, r[1] > residual.band ? fmt::format("about {:.0f} % (variance) of", 100 * r[1]) : "part of",
      end == r.end() ? "more than" : "about", duration_text(lags * block_s));
}

}  // namespace prism::analysis
