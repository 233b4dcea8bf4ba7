// SPDX-License-Identifier: MIT
#include "tools/prismcal/analysis/allan_text.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

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
  evaluation::NoiseType type;
  const std::optional<evaluation::AllanCoefficient>* coefficient;
};

std::vector<Entry> entries(const evaluation::AllanCoefficients& c) {
  using evaluation::NoiseType;
  return {{"quantisation Q", "quantisation_arcsec", "arcsec", NoiseType::kQuantisation, &c.quantisation_arcsec},
          {"angle random walk N", "angle_random_walk_deg_per_sqrt_h", "deg/sqrt(h)", NoiseType::kAngleRandomWalk,
           &c.angle_random_walk_deg_per_sqrt_h},
          {"bias instability B", "bias_instability_deg_per_h", "deg/h", NoiseType::kBiasInstability,
           &c.bias_instability_deg_per_h},
          {"rate random walk K", "rate_random_walk_deg_per_h_sqrt_h", "(deg/h)/sqrt(h)", NoiseType::kRateRandomWalk,
           &c.rate_random_walk_deg_per_h_sqrt_h},
          {"rate ramp R", "rate_ramp_deg_per_h_h", "(deg/h)/h", NoiseType::kRateRamp, &c.rate_ramp_deg_per_h_h}};
}

double at_least(const evaluation::AllanCoefficients& c, evaluation::NoiseType type) {
  return c.at_least[static_cast<std::size_t>(type)];
}

double at_most(const evaluation::AllanCoefficients& c, evaluation::NoiseType type) {
  return c.at_most[static_cast<std::size_t>(type)];
}

/// The interval of a coefficient without a value. Only R may have none.
std::string only_interval_text(const Entry& e, const evaluation::AllanCoefficients& all) {
  const double low = at_least(all, e.type), high = at_most(all, e.type);
  if (low > 0) return fmt::format("{:.4g} to {:.4g} {} (too uncertain for one value)\n", low, high, e.unit);
  const bool ramp = e.type == evaluation::NoiseType::kRateRamp;
  return fmt::format("{}at most {:.4g} {}\n", ramp ? "not determined: " : "", high, e.unit);
}

std::string gaps_text(const evaluation::AllanCurve& curve) {
  std::string text = counted(curve.holes, "gap");
  if (curve.missing > 0) text += fmt::format(" of {}", counted(curve.missing, "value"));
  return text;
}

std::string entry_text(const Entry& e, const evaluation::AllanCoefficients& all) {
  std::string text = fmt::format("{:<22} ", e.name);
  const auto& c = *e.coefficient;
  if (!c) return text + only_interval_text(e, all);
  text += fmt::format("{:.4g} {}, {:.4g} to {:.4g} (1 sigma {:.2g} %; largest noise from {:g} to {:g} s)\n", c->value,
                      e.unit, c->low, c->high, 100 * c->relative_sd, c->from_tau_s, c->to_tau_s);
  if (e.type != evaluation::NoiseType::kAngleRandomWalk) return text;
  const evaluation::WhiteNoiseDensity density = evaluation::white_noise_density(c->value);
  return text + fmt::format(
                    "  N of IEEE Std 952     {:.4g} deg/sqrt(h): S(f) = N^2, two-sided\n"
                    "  N of MATLAB           {:.4g} (rad/s)/sqrt(Hz): the same, read from the Allan deviation at 1 s\n"
                    "  one-sided density     {:.4g} (deg/s)/sqrt(Hz) = sqrt(2) N: data sheets, pwelch\n",
                    c->value, density.matlab_rad_per_s_per_sqrt_hz, density.one_sided_deg_per_s_per_sqrt_hz);
}

std::string floor_text(const evaluation::AllanFloor& floor) {
  return fmt::format("Allan minimum          {:.4g} deg/h at {:g} s, {:.4g} to {:.4g}, {} clusters{}\n",
                     floor.minimum_deg_per_h, floor.tau_s, floor.low_deg_per_h, floor.high_deg_per_h, floor.clusters,
                     floor.edge_limited ? " (last point; a longer record may give a lower one)" : "");
}

std::string misfit_text(double misfit) {
  if (misfit == 0) return "";
  return fmt::format(
      "The five noises describe the curve only within {:.2g} %: vibration, temperature or noise with one correlation "
      "time. The intervals of the coefficients allow for it.\n",
      50 * misfit);  // of the deviation: half of that of the variance
}

std::string point_text(const evaluation::AllanPoint& p, const evaluation::AllanInterval& interval) {
  if (!interval.determined)
    return fmt::format("{:>12g} {:>44} {:>10}  {}\n", p.tau_s, "not determined: missing values", p.clusters,
                       evaluation::noise_type_text(interval.type));
  return fmt::format("{:>12g} {:>14.6e} {:>14.6e} {:>14.6e} {:>10}  {}\n", p.tau_s, interval.deviation, interval.low,
                     interval.high, p.clusters, evaluation::noise_type_text(interval.type));
}

Json if_determined(const evaluation::AllanInterval& interval, double value) {
  return interval.determined ? Json(value) : Json(nullptr);
}

Json coefficient_json(const Entry& e) {
  const auto& c = *e.coefficient;
  if (!c) return nullptr;
  Json json = {{"value", c->value}, {"relative_sd", c->relative_sd}, {"low", c->low},
               {"high", c->high},   {"from_tau_s", c->from_tau_s},   {"to_tau_s", c->to_tau_s}};
  if (e.type == evaluation::NoiseType::kAngleRandomWalk) {
    const evaluation::WhiteNoiseDensity density = evaluation::white_noise_density(c->value);
    json["matlab_rad_per_s_per_sqrt_hz"] = density.matlab_rad_per_s_per_sqrt_hz;
    json["one_sided_deg_per_s_per_sqrt_hz"] = density.one_sided_deg_per_s_per_sqrt_hz;
  }
  return json;
}

Json coefficients_json(const evaluation::AllanCoefficients& c) {
  Json json = Json::object(), lowest = Json::object(), highest = Json::object();
  for (const Entry& e : entries(c)) {
    json[e.key] = coefficient_json(e);
    lowest[e.key] = at_least(c, e.type);
    highest[e.key] = at_most(c, e.type);
  }
  json["at_least"] = lowest;
  json["at_most"] = highest;
  json["misfit"] = c.misfit;
  json["minimum"] = {{"deviation_deg_per_h", c.floor.minimum_deg_per_h},
                     {"low_deg_per_h", c.floor.low_deg_per_h},
                     {"high_deg_per_h", c.floor.high_deg_per_h},
                     {"tau_s", c.floor.tau_s},
                     {"clusters", c.floor.clusters},
                     {"edge_limited", c.floor.edge_limited},
                     {"bias_instability_upper_bound_deg_per_h", at_most(c, evaluation::NoiseType::kBiasInstability)}};
  return json;
}

}  // namespace

Result<AllanAnalysis> analyse_allan(const recordings::RateSeries& series, evaluation::AllanGrid grid,
                                    evaluation::AllanEstimator estimator, double probability,
                                    const std::string& where) {
  const evaluation::RateSource rate = series.rate_deg_per_h.source();
  auto octaves = evaluation::allan_deviation(rate, series.interval_s,
                                             evaluation::allan_cluster_sizes(evaluation::AllanGrid::kOctave, rate.size),
                                             evaluation::AllanEstimator::kOverlapping, where);
  if (!octaves) return tl::unexpected(octaves.error());
  const auto model = evaluation::AllanModel::fit(*octaves, where);
  if (!model) return tl::unexpected(model.error());
  auto coefficients = evaluation::extract_coefficients(*octaves, *model, probability, where);
  const bool same = grid == evaluation::AllanGrid::kOctave && estimator == evaluation::AllanEstimator::kOverlapping;
  auto curve = same ? std::move(octaves)
                    : evaluation::allan_deviation(rate, series.interval_s,
                                                  evaluation::allan_cluster_sizes(grid, rate.size), estimator, where);
  if (!curve) return tl::unexpected(curve.error());
  auto intervals = evaluation::allan_confidence(*curve, *model, probability);
  return AllanAnalysis{std::move(*curve), std::move(intervals), std::move(coefficients), probability};
}

std::string allan_text(const AllanAnalysis& analysis, const recordings::RateSeries& series, const std::string& where) {
  const evaluation::AllanCurve& curve = analysis.curve;
  std::string text =
      fmt::format("{}: {} values of {}, every {:g} s ({}), {}, {}\n{} Allan deviation, {:g} % intervals\n\n", where,
                  curve.values, series.column, curve.tau0_s, series.interval_source, gaps_text(curve),
                  counted(curve.runs, "run"), estimator_text(curve.estimator), 100 * analysis.probability);
  text +=
      fmt::format("{:>12} {:>14} {:>14} {:>14} {:>10}  {}\n", "tau s", "dev deg/h", "low", "high", "clusters", "noise");
  for (std::size_t i = 0; i < curve.points.size(); ++i) {
    text += point_text(curve.points[i], analysis.intervals[i]);
  }
  text += '\n';
  if (!analysis.coefficients) return text + "no coefficients: " + analysis.coefficients.error().text() + "\n";
  for (const Entry& e : entries(*analysis.coefficients)) text += entry_text(e, *analysis.coefficients);
  return text + floor_text(analysis.coefficients->floor) + misfit_text(analysis.coefficients->misfit);
}

std::string allan_json(const AllanAnalysis& analysis, const recordings::RateSeries& series, const std::string& where) {
  const evaluation::AllanCurve& curve = analysis.curve;
  Json points = Json::array();
  for (std::size_t i = 0; i < curve.points.size(); ++i) {
    const evaluation::AllanPoint& p = curve.points[i];
    const evaluation::AllanInterval& interval = analysis.intervals[i];
    points.push_back({{"m", p.m},
                      {"tau_s", p.tau_s},
                      {"measured_deg_per_h", p.deviation},  // with the noise that missing values add
                      {"deviation_deg_per_h", if_determined(interval, interval.deviation)},
                      {"low_deg_per_h", if_determined(interval, interval.low)},
                      {"high_deg_per_h", if_determined(interval, interval.high)},
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
               {"missing", curve.missing},
               {"runs", curve.runs},
               {"tau0_s", curve.tau0_s},
               {"tau0_source", series.interval_source},
               {"estimator", estimator_text(curve.estimator)},
               {"probability", analysis.probability},
               {"points", points}};
  if (analysis.coefficients) {
    json["coefficients"] = coefficients_json(*analysis.coefficients);
  } else {
    json["coefficients"] = nullptr;
    json["no_coefficients_because"] = analysis.coefficients.error().text();
  }
  return json_text(json, 1) + "\n";
}

}  // namespace prism::analysis
