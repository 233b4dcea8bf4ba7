// SPDX-License-Identifier: MIT
#include "compensation/evaluation/allan_confidence.hpp"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>

#include "compensation/evaluation/allan_covariance.hpp"

namespace prism::evaluation {
namespace {

/// Lower tail probability of three standard deviations: so far below the estimate, missing values must not dominate.
/// Nearer, a point would be determined by chance, and only if it is too high.
constexpr double kSureTail = 0.99865, kSureShare = 0.5;

/// Degrees of freedom by the variance, and by the skewness.
struct Degrees {
  double edf, skewness;
};

/// A point of a curve, for the noises of a model.
class Point {
 public:
  Point(const AllanCurve& curve, std::size_t at)
      : curve_(curve),
        point_(curve.points[at]),
        variance_(point_.deviation * point_.deviation),
        covariance_(CurveCovariance(curve)(at, at)) {}

  Degrees degrees_of_freedom(const NoiseSquares& noise) const {
    const double expected = expected_variances(point_).dot(noise);
    const double edf = 2 * expected * expected / noise.dot(covariance_ * noise);
    const bool few = curve_.records.size() == 1 && curve_.estimator == AllanEstimator::kOverlapping &&
                     curve_.records.front() / point_.m < 8 &&
                     noise(static_cast<Eigen::Index>(NoiseType::kRateRamp)) == 0;
    if (!few) return {edf, edf};
    return {edf,
            std::min(edf, skewness_degrees_of_freedom(curve_.records.front(), point_.m, shown_noise(point_) * noise))};
  }

  /// The end of an interval of the Allan variance, and the own share of the point for the noises that it has there.
  struct End {
    double variance, share;
  };
  End end(const AllanModel& model, double probability) const {
    NoiseSquares noise = model.noise();
    Degrees degrees = degrees_of_freedom(noise);
    double end = variance_ / relative_quantile(degrees, probability);
    for (int pass = 0; pass < 3 && degrees.edf < 200; ++pass) {
      noise = model.noise_through(point_, end);
      degrees = degrees_of_freedom(noise);
      end = variance_ / relative_quantile(degrees, probability);
    }
    const double share = own_share(point_, noise);
    return {end * share, share};
  }

  const AllanPoint& point() const { return point_; }

 private:
  /// Estimate / truth at a lower tail probability: a chi-square number, shifted and scaled to the mean, the variance
  /// and the skewness. From a million degrees on, after Wilson and Hilferty.
  static double relative_quantile(const Degrees& degrees, double probability) {
    const auto& [edf, skewness] = degrees;
    if (!std::isfinite(edf)) return 1;
    if (edf < 1e6) {
      const double chi2 = boost::math::quantile(boost::math::chi_squared(skewness), probability);
      return 1 + (chi2 - skewness) / std::sqrt(edf * skewness);
    }
    const double z = boost::math::quantile(boost::math::normal(), probability), spread = 2 / (9 * edf);
    return std::pow(1 - spread + z * std::sqrt(spread), 3);
  }

  const AllanCurve& curve_;
  const AllanPoint& point_;
  double variance_;
  NoiseMatrix covariance_;
};

NoiseType largest_noise(const NoiseSquares& noise, double m) {
  Eigen::Index largest = 0;
  unit_variances(m).cwiseProduct(noise).maxCoeff(&largest);
  return static_cast<NoiseType>(largest);
}

}  // namespace

std::vector<AllanInterval> allan_confidence(const AllanCurve& curve, const AllanModel& model, double probability) {
  std::vector<AllanInterval> intervals;
  const double tail = 0.5 * (1 - probability);
  for (std::size_t i = 0; i < curve.points.size(); ++i) {
    const Point point(curve, i);
    AllanInterval interval;
    interval.type = largest_noise(model.noise(), static_cast<double>(point.point().m));
    interval.edf = point.degrees_of_freedom(model.noise()).edf;
    const double share = own_share(point.point(), model.noise());
    const Point::End low = point.end(model, 1 - tail), high = point.end(model, tail);
    interval.determined = share == 1 || (share >= kDeterminedShare && point.end(model, kSureTail).share >= kSureShare);
    interval.deviation = point.point().deviation * std::sqrt(share);
    interval.low = std::sqrt(low.variance);
    interval.high = std::sqrt(high.variance);
    intervals.push_back(interval);
  }
  return intervals;
}

}  // namespace prism::evaluation
