// SPDX-License-Identifier: MIT
#include "compensation/evaluation/allan_coefficients.hpp"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>

#include "compensation/evaluation/allan_strength.hpp"

namespace prism::evaluation {
namespace {

constexpr double kDetermined = 3;  ///< standard deviations between 0 and a coefficient that is determined

/// Coefficient of a strength, in the units of AllanCoefficients.
double coefficient_of(NoiseType type, double strength, double tau0_s) {
  const double root = std::sqrt(strength), tau0_h = tau0_s / 3600;
  switch (type) {
    case NoiseType::kQuantisation:
      return root * tau0_s;
    case NoiseType::kAngleRandomWalk:
      return root * std::sqrt(tau0_h);
    case NoiseType::kBiasInstability:
      return root / kAllanFlicker;
    case NoiseType::kRateRandomWalk:
      return root / std::sqrt(tau0_h);
    case NoiseType::kRateRamp:
      return root / tau0_h;
  }
  return 0;
}

/// The range of averaging times in which the noise is the largest; else the time at which its part is largest.
void set_range(AllanCoefficient& coefficient, NoiseType type, const AllanCurve& curve, const NoiseSquares& noise) {
  double largest_share = -1, at_s = 0;
  coefficient.from_tau_s = std::numeric_limits<double>::infinity();
  for (const AllanPoint& point : curve.points) {
    const NoiseSquares parts = unit_variances(static_cast<double>(point.m)).cwiseProduct(noise);
    const double own = parts(static_cast<Eigen::Index>(type));
    if (own / parts.sum() > largest_share) {
      largest_share = own / parts.sum();
      at_s = point.tau_s;
    }
    if (own < parts.maxCoeff()) continue;
    coefficient.from_tau_s = std::min(coefficient.from_tau_s, point.tau_s);
    coefficient.to_tau_s = point.tau_s;
  }
  if (std::isinf(coefficient.from_tau_s)) coefficient.from_tau_s = coefficient.to_tau_s = at_s;
}

/// Slope between neighbours an octave apart: log2 of their ratio.
bool flat(const AllanPoint& a, const AllanPoint& b) {
  return std::abs(std::log(b.deviation / a.deviation) / std::log(b.tau_s / a.tau_s)) <= 0.1;
}

/// Three octave points or more that are flat, and not above both ends: that is noise with one correlation time.
bool has_plateau(const AllanCurve& curve) {
  const auto& points = curve.points;
  for (std::size_t first = 0, last = 0; first < points.size(); first = last + 1) {
    last = first;
    double lowest = points[first].deviation;
    while (last + 1 < points.size() && points[last + 1].clusters >= 9 && flat(points[last], points[last + 1]))
      lowest = std::min(lowest, points[++last].deviation);
    const bool bump = first > 0 && last + 1 < points.size() && points[first - 1].deviation < lowest &&
                      points[last + 1].deviation < lowest;
    if (last - first >= 2 && !bump) return true;
  }
  return false;
}

class Extraction {
 public:
  Extraction(const AllanCurve& curve, const AllanModel& model, double probability)
      : curve_(curve),
        model_(model),
        probability_(probability),
        z_(boost::math::quantile(boost::math::normal(), 0.5 * (1 + probability))) {}

  /// Sets the ends of the interval; returns the coefficient if it is determined. `type`: not R.
  std::optional<AllanCoefficient> of(NoiseType type, double& at_least, double& at_most) const {
    const auto value = [&](double strength) { return coefficient_of(type, strength, curve_.tau0_s); };
    const StrengthInterval interval = strength_interval(model_, type, probability_);
    at_least = value(interval.low);
    at_most = value(interval.high);
    const double best = model_.best()(static_cast<Eigen::Index>(type));
    if (!(best > 0) || model_.distance(type, 0) < kDetermined) return std::nullopt;
    if (type == NoiseType::kBiasInstability && model_.misfit() > 0 && !has_plateau(curve_)) return std::nullopt;
    AllanCoefficient found;
    // The test lets the other noises be slightly negative, the best fit does not: it may be just outside the interval.
    found.value = std::clamp(value(best), at_least, at_most);
    found.low = at_least;
    found.high = at_most;
    finish(found, type);
    return found;
  }

  std::optional<AllanCoefficient> ramp(double& at_least, double& at_most) const {
    const double per_h = 3600 / curve_.tau0_s, slope = std::abs(model_.slope()) * per_h, sd = model_.slope_sd() * per_h;
    at_most = slope + z_ * sd;
    if (!model_.ramp_is_certain() || only_flicker_is_slow()) return std::nullopt;
    AllanCoefficient found;
    found.value = slope;
    found.low = at_least = std::max(0.0, slope - z_ * sd);
    found.high = at_most;
    finish(found, NoiseType::kRateRamp);
    return found;
  }

 private:
  /// The points show slow noise, but no K: it may be hidden behind B, and decides how uncertain the slope is.
  bool only_flicker_is_slow() const {
    const NoiseSquares& noise = model_.noise();
    return noise(static_cast<Eigen::Index>(NoiseType::kBiasInstability)) > 0 &&
           !(noise(static_cast<Eigen::Index>(NoiseType::kRateRandomWalk)) > 0);
  }

  void finish(AllanCoefficient& found, NoiseType type) const {
    found.relative_sd = (found.high - found.low) / (2 * z_ * found.value);
    set_range(found, type, curve_, model_.noise());
  }

  const AllanCurve& curve_;
  const AllanModel& model_;
  double probability_, z_;
};

AllanFloor find_floor(const AllanCurve& curve, const AllanModel& model, double probability) {
  const auto& points = curve.points;
  const auto variance = [&](const AllanPoint& point) {
    const double share = own_share(point, model.noise());
    return share >= kDeterminedShare ? share * point.deviation * point.deviation
                                     : std::numeric_limits<double>::infinity();
  };
  std::size_t lowest = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (variance(points[i]) < variance(points[lowest])) lowest = i;
  }
  AllanCurve only = curve;
  only.points = {points[lowest]};
  const AllanInterval interval = allan_confidence(only, model, probability).front();
  return {interval.deviation,      points[lowest].tau_s, lowest + 1 == points.size(),
          points[lowest].clusters, interval.low,         interval.high};
}

}  // namespace

Result<AllanCoefficients> extract_coefficients(const AllanCurve& curve, const AllanModel& model, double probability,
                                               const std::string& where) {
  if (curve.points.size() < 3) {
    return make_error(where, std::to_string(curve.points.size()) + " points on the Allan curve; expected 3 or more");
  }
  const Extraction extraction(curve, model, probability);
  AllanCoefficients result;
  const auto at_least = [&](NoiseType type) -> double& { return result.at_least[static_cast<std::size_t>(type)]; };
  const auto at_most = [&](NoiseType type) -> double& { return result.at_most[static_cast<std::size_t>(type)]; };
  result.rate_ramp_deg_per_h_h = extraction.ramp(at_least(NoiseType::kRateRamp), at_most(NoiseType::kRateRamp));
  result.misfit = model.misfit();
  result.floor = find_floor(curve, model, probability);
  if (!((model.best().array() > 0).head(kNoiseTypes - 1).any())) return result;  // a ramp without noise
  for (const auto& [type, coefficient] : {std::pair{NoiseType::kQuantisation, &result.quantisation_arcsec},
                                          {NoiseType::kAngleRandomWalk, &result.angle_random_walk_deg_per_sqrt_h},
                                          {NoiseType::kBiasInstability, &result.bias_instability_deg_per_h},
                                          {NoiseType::kRateRandomWalk, &result.rate_random_walk_deg_per_h_sqrt_h}})
    *coefficient = extraction.of(type, at_least(type), at_most(type));
  return result;
}

WhiteNoiseDensity white_noise_density(double angle_random_walk_deg_per_sqrt_h) {
  const double deg_per_sqrt_s = angle_random_walk_deg_per_sqrt_h / 60;
  return {deg_per_sqrt_s * std::numbers::pi / 180, std::numbers::sqrt2 * deg_per_sqrt_s};
}

}  // namespace prism::evaluation
