// SPDX-License-Identifier: MIT
#include "tools/prismcal/analysis/allan_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "base/plain_text.hpp"
#include "tools/prismcal/analysis/recording_report.hpp"

namespace prism::analysis {
namespace {

using Json = nlohmann::ordered_json;
using evaluation::AllanAnalysis, evaluation::AllanCoefficient, evaluation::AllanPoint, evaluation::NoiseType;

/// The printed name, JSON key and unit of each coefficient, in the order of NoiseType.
struct Entry {
  const char* name;
  const char* key;
  const char* unit;
};
constexpr Entry kEntries[evaluation::kNoiseTypes] = {
    {"quantisation Q", "quantisation_arcsec", "arcsec"},
    {"angle random walk N", "angle_random_walk_deg_per_sqrt_h", "deg/sqrt(h)"},
    {"bias instability B", "bias_instability_deg_per_h", "deg/h"},
    {"rate random walk K", "rate_random_walk_deg_per_h_sqrt_h", "(deg/h)/sqrt(h)"},
    {"rate ramp R", "rate_ramp_deg_per_h_h", "(deg/h)/h"}};
constexpr auto kWalk = static_cast<std::size_t>(NoiseType::kAngleRandomWalk);

std::string coefficient_text(const Entry& entry, const AllanCoefficient& c) {
  if (!c.value) return fmt::format("{:<22} at most {:.4g} {}\n", entry.name, c.high, entry.unit);
  return fmt::format("{:<22} {:.4g} {}, {:.4g} to {:.4g}\n", entry.name, *c.value, entry.unit, c.low, c.high);
}

std::string definitions_text(double walk) {
  return fmt::format(
      "  N of IEEE Std 952     {:.4g} deg/sqrt(h): S(f) = N^2, two-sided\n"
      "  N of MATLAB           {:.4g} (rad/s)/sqrt(Hz): the same, read from the Allan deviation at 1 s\n"
      "  one-sided density     {:.4g} (deg/s)/sqrt(Hz) = sqrt(2) N: data sheets, pwelch\n",
      walk, evaluation::matlab_rad_per_s_per_sqrt_hz(walk), evaluation::one_sided_deg_per_s_per_sqrt_hz(walk));
}

std::string minimum_text(const AllanAnalysis& analysis) {
  const AllanPoint& p = analysis.minimum();
  return fmt::format("Allan minimum          {:.4g} deg/h at {:g} s, {:.4g} to {:.4g}{}\n", p.deviation, p.tau_s, p.low,
                     p.high,
                     &p == &analysis.points.back() ? " (last point; a longer record may give a lower one)" : "");
}

Json coefficients_json(const AllanAnalysis& analysis) {
  Json json = Json::object(), most = Json::object();
  for (std::size_t k = 0; k < evaluation::kNoiseTypes; ++k) {
    const AllanCoefficient& c = (*analysis.coefficients)[k];
    Json& found = json[kEntries[k].key] = nullptr;
    if (c.value) found = {{"value", *c.value}, {"low", c.low}, {"high", c.high}};
    if (!c.value) most[kEntries[k].key] = c.high;
    if (!c.value || k != kWalk) continue;
    found["matlab_rad_per_s_per_sqrt_hz"] = evaluation::matlab_rad_per_s_per_sqrt_hz(*c.value);
    found["one_sided_deg_per_s_per_sqrt_hz"] = evaluation::one_sided_deg_per_s_per_sqrt_hz(*c.value);
  }
  json["at_most"] = most;
  json["unexplained_tau_s"] = analysis.unexplained_s;
  return json;
}

}  // namespace

std::string allan_text(const AllanAnalysis& analysis, const recordings::RateSeries& series, const std::string& where) {
  std::string text = fmt::format("{}: {} values of {}, every {:g} s ({}), {}", where, analysis.values, series.column,
                                 analysis.tau0_s, series.interval_source, counted(analysis.holes, "gap"));
  if (analysis.missing > 0) text += fmt::format(" of {}", counted(analysis.missing, "value"));
  text += fmt::format("\noverlapping Allan deviation, 68 % intervals\n\n{:>12} {:>14} {:>14} {:>14}  {}\n", "tau s",
                      "dev deg/h", "low", "high", "largest noise");
  for (const AllanPoint& p : analysis.points) {
    text += fmt::format("{:>12g} {:>14.6e} {:>14.6e} {:>14.6e}  {}\n", p.tau_s, p.deviation, p.low, p.high,
                        evaluation::noise_type_text(p.noise));
  }
  text += '\n';
  if (!analysis.coefficients) return text + "no coefficients: " + analysis.coefficients.error().text() + "\n";
  for (std::size_t k = 0; k < evaluation::kNoiseTypes; ++k) {
    const AllanCoefficient& c = (*analysis.coefficients)[k];
    text += coefficient_text(kEntries[k], c);
    if (k == kWalk && c.value) text += definitions_text(*c.value);
  }
  text += minimum_text(analysis);
  const std::string unexplained = unexplained_text(analysis);
  return unexplained.empty() ? text : text + unexplained + "\n";
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
