// SPDX-License-Identifier: MIT
#include "tools/prismcal/analysis/allan_text.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "base/plain_text.hpp"

namespace prism::analysis {
namespace {

using Json = nlohmann::ordered_json;

const char* estimator_text(evaluation::AllanEstimator estimator) {
  return estimator == evaluation::AllanEstimator::kOverlapping ? "overlapping" : "non-overlapping";
}

/// One coefficient: its printed name and letter, its JSON key, its unit.
struct Entry {
  const char* name;
  const char* key;
  const char* unit;
  const std::optional<evaluation::AllanCoefficient>* coefficient;
};

std::vector<Entry> entries(const evaluation::AllanCoefficients& c) {
  return {
      {"quantisation Q", "quantisation_arcsec", "arcsec", &c.quantisation_arcsec},
      {"angle random walk N", "angle_random_walk_deg_per_sqrt_h", "deg/sqrt(h)", &c.angle_random_walk_deg_per_sqrt_h},
      {"bias instability B", "bias_instability_deg_per_h", "deg/h", &c.bias_instability_deg_per_h},
      {"rate random walk K", "rate_random_walk_deg_per_h_sqrt_h", "(deg/h)/sqrt(h)",
       &c.rate_random_walk_deg_per_h_sqrt_h},
      {"rate ramp R", "rate_ramp_deg_per_h_h", "(deg/h)/h", &c.rate_ramp_deg_per_h_h}};
}

std::string floor_text(const evaluation::AllanFloor& floor) {
  return fmt::format("Allan minimum          {:.4g} deg/h at {:g} s, {} clusters{}: B is at most {:.4g} deg/h\n",
                     floor.minimum_deg_per_h, floor.tau_s, floor.clusters,
                     floor.edge_limited ? " (last point; a longer record may give a lower one)" : "",
                     floor.minimum_deg_per_h / evaluation::kAllanFlicker);
}

}  // namespace

Result<AllanAnalysis> analyse_allan(const recordings::RateSeries& series, evaluation::AllanGrid grid,
                                    evaluation::AllanEstimator estimator, double probability,
                                    const std::string& where) {
  const auto& rate = series.rate_deg_per_h;
  const auto curve = evaluation::allan_deviation(rate, series.interval_s,
                                                 evaluation::allan_cluster_sizes(grid, rate.size()), estimator, where);
  if (!curve) return tl::unexpected(curve.error());
  const auto octaves = evaluation::allan_deviation(
      rate, series.interval_s, evaluation::allan_cluster_sizes(evaluation::AllanGrid::kOctave, rate.size()),
      evaluation::AllanEstimator::kOverlapping, where);
  if (!octaves) return tl::unexpected(octaves.error());
  return AllanAnalysis{
      *curve, evaluation::allan_confidence(*curve, rate, probability),
      evaluation::extract_coefficients(*octaves, evaluation::allan_confidence(*octaves, rate, probability), where),
      probability};
}

std::string allan_text(const AllanAnalysis& analysis, const recordings::RateSeries& series, const std::string& where) {
  const evaluation::AllanCurve& curve = analysis.curve;
  std::string text =
      fmt::format("{}: {} values of {}, every {:g} s ({}), {}, {}\n{} Allan deviation, {:g} % intervals\n\n", where,
                  curve.values, series.column, curve.tau0_s, series.interval_source, counted(curve.holes, "gap"),
                  counted(curve.runs, "run"), estimator_text(curve.estimator), 100 * analysis.probability);
  text +=
      fmt::format("{:>12} {:>14} {:>14} {:>14} {:>10}  {}\n", "tau s", "dev deg/h", "low", "high", "clusters", "noise");
  for (std::size_t i = 0; i < curve.points.size(); ++i) {
    const evaluation::AllanPoint& p = curve.points[i];
    const evaluation::AllanInterval& interval = analysis.intervals[i];
    text += fmt::format("{:>12g} {:>14.6e} {:>14.6e} {:>14.6e} {:>10}  {}\n", p.tau_s, p.deviation, interval.low,
                        interval.high, p.clusters, evaluation::noise_type_text(interval.type));
  }
  text += '\n';
  if (!analysis.coefficients) return text + "no coefficients: " + analysis.coefficients.error().text() + "\n";
  for (const Entry& e : entries(*analysis.coefficients)) {
    text += fmt::format("{:<22} ", e.name);
    if (const auto& c = *e.coefficient) {
      text += fmt::format("{:.4g} {} (1 sigma {:.2g} %; rules from {:g} to {:g} s)\n", c->value, e.unit,
                          100 * c->relative_sd, c->from_tau_s, c->to_tau_s);
    } else {
      text += "not resolved in this record\n";
    }
  }
  return text + floor_text(analysis.coefficients->floor);
}

std::string allan_json(const AllanAnalysis& analysis, const recordings::RateSeries& series, const std::string& where) {
  const evaluation::AllanCurve& curve = analysis.curve;
  Json points = Json::array(), coefficients = Json::object();
  for (std::size_t i = 0; i < curve.points.size(); ++i) {
    const evaluation::AllanPoint& p = curve.points[i];
    const evaluation::AllanInterval& interval = analysis.intervals[i];
    points.push_back({{"m", p.m},
                      {"tau_s", p.tau_s},
                      {"deviation_deg_per_h", p.deviation},
                      {"low_deg_per_h", interval.low},
                      {"high_deg_per_h", interval.high},
                      {"edf", interval.edf},
                      {"clusters", p.clusters},
                      {"terms", p.terms},
                      {"noise", evaluation::noise_type_text(interval.type)}});
  }
  Json json = {{"file", where},
               {"column", series.column},
               {"unit", series.unit},
               {"values", curve.values},
               {"holes", curve.holes},
               {"runs", curve.runs},
               {"tau0_s", curve.tau0_s},
               {"tau0_source", series.interval_source},
               {"estimator", estimator_text(curve.estimator)},
               {"probability", analysis.probability},
               {"points", points}};
  if (analysis.coefficients) {
    for (const Entry& e : entries(*analysis.coefficients)) {
      const auto& c = *e.coefficient;
      coefficients[e.key] = c ? Json{{"value", c->value},
                                     {"relative_sd", c->relative_sd},
                                     {"from_tau_s", c->from_tau_s},
                                     {"to_tau_s", c->to_tau_s}}
                              : Json(nullptr);
    }
    const evaluation::AllanFloor& floor = analysis.coefficients->floor;
    coefficients["minimum"] = {
        {"deviation_deg_per_h", floor.minimum_deg_per_h},
        {"tau_s", floor.tau_s},
        {"clusters", floor.clusters},
        {"edge_limited", floor.edge_limited},
        {"bias_instability_upper_bound_deg_per_h", floor.minimum_deg_per_h / evaluation::kAllanFlicker}};
    json["coefficients"] = coefficients;
  } else {
    json["coefficients"] = nullptr;
    json["no_coefficients_because"] = analysis.coefficients.error().text();
  }
  return json_text(json, 1) + "\n";
}

}  // namespace prism::analysis
