// SPDX-License-Identifier: MIT
#include "compensation/training/composite_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "compensation/training/quasi_newton.hpp"

namespace prism::training {
namespace {

constexpr Eigen::Index kCoarseSamples = 320, kMiddleSamples = 500, kFineSamples = 1000;
constexpr double kSameOptimum = 0.02;  // two values of the objective
constexpr int kCoarseEvaluations = 60, kFineEvaluations = 40;

// Starts of the search: [s1², l², s2², s3², s4², tau, s_n²] (offsets: s5²). A smooth bias with white noise; a
// polynomial; a wiggly one; mostly drift.
std::vector<Eigen::VectorXd> starts(Eigen::Index inputs, bool offsets) {
  struct Start {
    double rbf, length2, linear, quadratic, nuisance, time_h, noise;
  };
  constexpr Start kStarts[] = {{-1, 0.7, -1, -2, -2, 0.7, -2},
                               {-3, 2, -0.5, -1, -3, 2, -1.5},
                               {-1, -1, -2, -4, -4, 1, -2},
                               {-2, 1, -1, -3, -1, 1.5, -3}};
  std::vector<Eigen::VectorXd> all;
  for (const Start& s : kStarts) {
    Eigen::VectorXd theta(inputs + (offsets ? 7 : 6));
    theta[0] = s.rbf;
    theta.segment(1, inputs).setConstant(s.length2);
    theta.segment(1 + inputs, 5) << s.linear, s.quadratic, s.nuisance, s.time_h, s.noise;
    if (offsets) theta[6 + inputs] = -3;
    all.push_back(theta);
  }
  return all;
}

class Search {
 public:
  Search(const DriftPrior& drift, const CompositeProgress& progress, const std::function<bool()>& stop)
      : drift_(drift), progress_(progress), stop_(stop) {}

  int evaluations() const { return evaluations_; }

  QuasiNewtonResult descend(const CompositeSamples& samples, const Eigen::VectorXd& weight,
                            const Eigen::VectorXd& start, int limit, const Eigen::MatrixXd& inverse_hessian = {}) {
    const auto f = [&](const Eigen::VectorXd& theta, Eigen::VectorXd& gradient) {
      constexpr double kImpossible = std::numeric_limits<double>::infinity();
      constexpr double kFarthest = 25;  // e^±25: no data can distinguish such a parameter from 0 or infinity
      if (!(theta.cwiseAbs().maxCoeff() < kFarthest)) return kImpossible;
      const auto system = CompositeSystem::make(samples, theta, weight);
      const double value = system ? system->objective(&gradient, drift_) : kImpossible;
      best_ = std::min(best_, value);
      if (progress_) progress_(++evaluations_, kExpected, best_);
      return value;
    };
    QuasiNewtonSettings s;
    s.max_evaluations = limit;
    s.inverse_hessian = inverse_hessian;
    s.f_tolerance = 1e-4;  // of a log likelihood: a smaller difference distinguishes no models
    s.g_tolerance = 1e-3;
    return minimise_smooth(f, start, s, stop_);
  }

 private:
  static constexpr int kExpected = 4 * 45 + 3 * 20;
  const DriftPrior drift_;
  const CompositeProgress& progress_;
  const std::function<bool()>& stop_;
  int evaluations_ = 0;
  double best_ = std::numeric_limits<double>::infinity();
};

}  // namespace

double believed_sd(const Eigen::VectorXd& y, const Eigen::VectorXd& weight) {
  const Eigen::ArrayXd believed = (weight.array() >= kBelievedWeight).cast<double>();
  const double mean = (believed * y.array()).sum() / believed.sum();
  return std::sqrt((believed * (y.array() - mean).square()).sum() / believed.sum());
}

std::optional<CompositeSystem> reweighted_system(const CompositeSamples& samples, const Eigen::VectorXd& theta,
                                                 ReweightSettings settings, Eigen::VectorXd& weight,
                                                 ReweightReport& report) {
  settings.min_weight = kMinCompositeWeight;
  std::optional<CompositeSystem> system;
  const auto solve = [&](const Eigen::VectorXd& v) -> Result<Eigen::VectorXd> {
    system = CompositeSystem::make(samples, theta, v);
    if (!system) return make_error("composite kernel", "the covariance of the samples is not positive definite");
    return system->residual();
  };
  const auto done = reweight(settings, weight, solve, weights_settled());
  if (!done) return std::nullopt;
  report = *done;
  return system;
}

namespace {

// Re-weights at `from`, then descends. `scale`: from the samples of its inverse Hessian to those of `part`.
std::optional<QuasiNewtonResult> refined(Search& search, const CompositeSamples& part, const ReweightSettings& settings,
                                         Eigen::VectorXd weight, const QuasiNewtonResult& from, double scale) {
  ReweightReport report;
  if (!reweighted_system(part, from.x, settings, weight, report)) return std::nullopt;
  return search.descend(part, weight, from.x, kFineEvaluations, from.inverse_hessian * scale);
}

// The optima that the starts find, the best first; those of equal value are one.
std::vector<QuasiNewtonResult> optima(Search& search, const CompositeSamples& coarse, const Eigen::VectorXd& weight) {
  std::vector<QuasiNewtonResult> all;
  for (const Eigen::VectorXd& start : starts(coarse.x.rows(), coarse.recordings > 1)) {
    auto found = search.descend(coarse, weight, start, kCoarseEvaluations);
    if (std::isfinite(found.value)) all.push_back(std::move(found));
  }
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.value < b.value; });
  all.erase(std::unique(all.begin(), all.end(),
                        [](const auto& a, const auto& b) { return b.value - a.value < kSameOptimum; }),
            all.end());
  return all;
}

// The best optimum, unless another one is clearly better with robust weights: without them outliers decide. Weights
// differ between optima, so that small differences do not count.
std::optional<QuasiNewtonResult> best_weighted(Search& search, const CompositeSamples& coarse,
                                               const ReweightSettings& settings, const Eigen::VectorXd& first) {
  constexpr double kClear = 5;  // of the log likelihood
  std::optional<QuasiNewtonResult> best;
  double limit = std::numeric_limits<double>::infinity();
  for (const QuasiNewtonResult& optimum : optima(search, coarse, first)) {
    auto found = refined(search, coarse, settings, first, optimum, 1);
    if (!found || !(found->value < limit)) continue;
    limit = best ? found->value : found->value - kClear;
    best = std::move(found);
  }
  return best;
}

}  // namespace

Result<CompositeFit> search_composite(const CompositeSamples& samples, const ReweightSettings& settings,
                                      const DriftPrior& drift, const CompositeProgress& progress,
                                      const std::function<bool()>& stop, const Eigen::VectorXd& given) {
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(samples.y.size()), first = given.size() > 0 ? given : ones;
  // Outliers enlarge the variance of the target, of which the drift is expected to be a share.
  DriftPrior expected = drift;
  expected.centre += 2 * std::log(believed_sd(samples.y, first) / believed_sd(samples.y, ones));
  Search search(expected, progress, stop);
  const std::vector<Eigen::Index> few = thinned(samples.y.size(), kCoarseSamples);
  const CompositeSamples coarse = samples.part(few);
  auto best = best_weighted(search, coarse, settings, first(few));
  if (!best) return make_error("composite kernel", "the search found no finite likelihood from any start");
  double searched = static_cast<double>(coarse.y.size());
  for (const Eigen::Index most : {kMiddleSamples, kFineSamples}) {
    if (static_cast<Eigen::Index>(searched) == samples.y.size()) break;
    const std::vector<Eigen::Index> rows = thinned(samples.y.size(), most);
    const CompositeSamples part = samples.part(rows);
    const double now = static_cast<double>(part.y.size());
    best = refined(search, part, settings, first(rows), *best, searched / now);
    if (!best) return make_error("composite kernel", "the search found no model");
    searched = now;
  }
  return CompositeFit{best->x, first, best->value, search.evaluations()};
}

}  // namespace prism::training
