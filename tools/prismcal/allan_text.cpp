// SPDX-License-Identifier: MIT
#include "tools/prismcal/allan_text.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "base/plain_text.hpp"
#include "tools/prismcal/recording_report.hpp"

namespace prism::analysis {
namespace {

using Json = nlohmann::ordered_json;
using evaluation::AllanAnalysis, evaluation::AllanCoefficient, evaluation::AllanPoint, evaluation::NoiseType;

/// JSON keys, in the order of NoiseType.
constexpr const char* kKeys[evaluation::kNoiseTypes] = {"quantisation_arcsec", "angle_random_walk_deg_per_sqrt_h",
                                                        "bias_instability_deg_per_h",
                                                        "rate_random_walk_deg_per_h_sqrt_h", "rate_ramp_deg_per_h_h"};
constexpr auto kWalk = static_cast<std::size_t>(NoiseType::kAngleRandomWalk);

Json coefficients_json(const AllanAnalysis& analysis) {
  Json json = Json::object(), most = Json::object();
  for (std::size_t k = 0; k < evaluation::kNoiseTypes; ++k) {
    const AllanCoefficient& c = (*analysis.coefficients)[k];
    Json& found = json[kKeys[k]] = nullptr;
    if (c.value) found = {{"value", *c.value}, {"low", c.low}, {"high", c.high}};
    if (!c.value) most[kKeys[k]] = c.high;
    if (!c.value || k != kWalk) continue;
    found["matlab_rad_per_s_per_sqrt_hz"] = evaluation::matlab_rad_per_s_per_sqrt_hz(*c.value);
    found["one_sided_deg_per_s_per_sqrt_hz"] = evaluation::one_sided_deg_per_s_per_sqrt_hz(*c.value);
  }
  json["at_most"] = most;
  json["unexplained_tau_s"] = analysis.unexplained_s;
  return json;
}

}  // namespace

report::Report allan_report(const AllanAnalysis& analysis, const Result<evaluation::Spectrum>& spectrum,
                            const recordings::RateSeries& series, const std::string& where) {
  report::Report report;
  report.title =
      "Allan deviation of gyro " + (series.gyro_serial.empty() ? "without a serial number" : series.gyro_serial);
  report.subtitle = where;
  std::string data = fmt::format("{}: {} values of {}, every {:g} s ({}), {}", where, analysis.values, series.column,
                                 analysis.tau0_s, series.interval_source, counted(analysis.holes, "gap"));
  if (analysis.missing > 0) data += fmt::format(" of {}", counted(analysis.missing, "value"));
  report::Section section{"conclusion", "Conclusion", {report::Paragraph{data + "."}}};
  if (const std::string text = unexplained_text(analysis); !text.empty())
    section.blocks.emplace_back(report::Paragraph{text, report::Emphasis::kWarn});
  if (!analysis.coefficients)
    section.blocks.emplace_back(report::Paragraph{"No coefficients: " + analysis.coefficients.error().text()});
  section.blocks.emplace_back(noise_parameters_table(analysis));
  report::Figure figure{"allan_curve", "Allan deviation and power spectral density", kNoiseCaption,
                        noise_plot({{"", report::Ink::kCorrected, &analysis, spectrum ? &*spectrum : nullptr}}),
                        spectrum ? lines_text(*spectrum) : spectrum.error().text()};
  report::Table points{"points", "Allan deviation at each averaging time", "Overlapping; intervals of 68 %.",
                       report::columns("tau [s] | deviation [deg/h] | low [deg/h] | high [deg/h] | largest noise:")};
  for (const AllanPoint& p : analysis.points)
    points.rows.push_back({report::general_cell(p.tau_s, 6), report::general_cell(p.deviation, 7),
                           report::general_cell(p.low, 7), report::general_cell(p.high, 7),
                           evaluation::noise_type_text(p.noise)});
  report.sections = {std::move(section), {"curves", "Curves", {std::move(figure), std::move(points)}}};
  return report;
}

std::string allan_json(const AllanAnalysis& analysis, const recordings::RateSeries& series, const std::string& where) {
  Json points = Json::array();
  for (const AllanPoint& p : analysis.points) {
    points.push_back({{"m", p.m},
                      {"tau_s", p.tau_s},
                      {"deviation_deg_per_h", p.deviation},
                      {"low_deg_per_h", p.low},
                      {"high_deg_per_h", p.high},
                      {"edf", p.edf},
                      {"windows", p.windows},
                      {"noise", evaluation::noise_type_text(p.noise)}});
  }
  Json json = {{"file", where},
               {"column", series.column},
               {"unit", series.unit},
               {"values", analysis.values},
               {"holes", analysis.holes},
               {"missing", analysis.missing},
               {"tau0_s", analysis.tau0_s},
               {"tau0_source", series.interval_source},
               {"points", points}};
  json["coefficients"] = analysis.coefficients ? coefficients_json(analysis) : Json(nullptr);
  if (!analysis.coefficients) json["no_coefficients_because"] = analysis.coefficients.error().text();
  return json_text(json, 1) + "\n";
}

}  // namespace prism::analysis
