// SPDX-License-Identifier: MIT
#include "compensation/training/composite_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "compensation/training/dense.hpp"
#include "compensation/training/low_rank.hpp"
#include "compensation/training/minimise.hpp"
#include "compensation/training/nuisance_filter.hpp"

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

namespace {

constexpr Eigen::Index kPivotSamples = 4000, kPiece = 1024;
constexpr double kLeftOfNoise = 1e-3;  // maximum kernel variance outside the centres, in noise variances

constexpr int kSparseSolves = 30;

struct Pivots {
  std::vector<Eigen::Index> chosen;
  double left = 0;
};

// Pivots of the kernel matrix over every n-th sample.
Pivots choose_centres(const compensation::CompositeVariances& v, const Eigen::MatrixXd& points, Eigen::Index max_rank) {
  const std::vector<Eigen::Index> tried = thinned(points.cols(), kPivotSamples);
  const Eigen::MatrixXd x = points(Eigen::all, tried);
  const compensation::CompositeCentres centres(v.kernel, x);
  Eigen::VectorXd variance(x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) variance[i] = v.kernel.variance(x.col(i));
  const auto row = [&](Eigen::Index i, Eigen::VectorXd& k) { k = centres.row(x.col(i)); };
  const PivotedCholesky found = pivoted_cholesky(variance, row, kLeftOfNoise * v.noise, max_rank);
  Pivots pivots{{}, found.left};
  for (const Eigen::Index i : found.pivots) pivots.chosen.push_back(tried[static_cast<std::size_t>(i)]);
  return pivots;
}

class SparseSystem {
 public:
  SparseSystem(const CompositeSamples& samples, const compensation::CompositeVariances& variances,
               std::vector<Eigen::Index> centres)
      : samples_(samples), variances_(variances), centres_(std::move(centres)) {}

  bool prepare() {
    const Eigen::MatrixXd points = samples_.x(Eigen::all, centres_);
    factor_ = variances_.kernel.matrix(points);
    factor_.diagonal().array() += compensation::kCompositeJitter * variances_.kernel.rbf;
    if (!cholesky(factor_)) return false;
    const compensation::CompositeCentres centres(variances_.kernel, points);
    psi_.resize(rank() + 1, samples_.y.size());
    for (Eigen::Index i = 0; i < psi_.cols(); ++i) {
      Eigen::VectorXd k = centres.row(samples_.x.col(i));
      solve_lower(factor_, k);
      psi_.col(i) << k, 1.0;
    }
    return true;
  }

  bool solve(const Eigen::VectorXd& weight) {
    const Eigen::Index r = rank(), n = samples_.y.size();
    const NuisanceFilter filter(variances_, samples_.time_h, samples_.recording, weight);
    NuisanceFilter::Carry carry(r + 2);
    Eigen::MatrixXd moments = Eigen::MatrixXd::Zero(r + 2, r + 2);
    for (Eigen::Index first = 0; first < n; first += kPiece) {
      const Eigen::Index count = std::min(kPiece, n - first);
      Eigen::MatrixXd piece(r + 2, count);
      piece << psi_.middleCols(first, count), samples_.y.segment(first, count).transpose();
      filter.whiten(piece, first, carry);
      add_gram(piece, moments);
    }
    gram_ = moments.topLeftCorner(r + 1, r + 1);
    gram_.diagonal().head(r).array() += 1;
    w_ = moments.row(r + 1).head(r + 1).transpose();
    Eigen::MatrixXd factor = gram_;
    if (!cholesky(factor)) return false;
    solve_cholesky(factor, w_);
    residual_ = samples_.y - psi_.transpose() * w_;
    noise_residual_ = variances_.noise * filter.solve(residual_).cwiseQuotient(weight);
    return w_.allFinite();
  }

  Eigen::Index rank() const { return static_cast<Eigen::Index>(centres_.size()); }
  const Eigen::VectorXd& noise_residual() const { return noise_residual_; }

  // alpha over the centres: w · φ(x) = (L⁻ᵀ w) · k(x).
  SparseComposite result(Eigen::VectorXd weight, ReweightReport report, double left) {
    SparseComposite fit;
    fit.alpha = w_.head(rank());
    solve_lower_transposed(factor_, fit.alpha);
    fit.beta = w_[rank()];
    fit.gram = gram_.selfadjointView<Eigen::Lower>();
    fit.centres = std::move(centres_);
    fit.weight = std::move(weight);
    fit.residual = residual_;
    fit.reweight = std::move(report);
    fit.left = left;
    return fit;
  }

 private:
  const CompositeSamples& samples_;
  const compensation::CompositeVariances& variances_;
  std::vector<Eigen::Index> centres_;
  Eigen::MatrixXd factor_, psi_, gram_;
  Eigen::VectorXd w_, residual_, noise_residual_;
};

}  // namespace

std::optional<SparseComposite> fit_sparse_composite(const CompositeSamples& samples, const Eigen::VectorXd& theta,
                                                    ReweightSettings settings, Eigen::Index max_rank) {
  const compensation::CompositeVariances variances = composite_variances(theta, samples.x.rows());
  Pivots pivots = choose_centres(variances, samples.x, max_rank);
  SparseSystem system(samples, variances, std::move(pivots.chosen));
  if (!system.prepare()) return std::nullopt;
  settings.min_weight = kMinCompositeWeight;
  settings.limit = std::min(settings.limit, kSparseSolves);
  const auto solve = [&](const Eigen::VectorXd& v) -> Result<Eigen::VectorXd> {
    if (system.solve(v)) return system.noise_residual();
    return make_error("composite kernel", "the covariance of the centres is not positive definite");
  };
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(samples.y.size());
  const auto report = reweight(settings, weight, solve, weights_settled());
  if (!report) return std::nullopt;
  return system.result(std::move(weight), *report, pivots.left);
}

}  // namespace prism::training
