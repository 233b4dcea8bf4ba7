// SPDX-License-Identifier: MIT
#include "compensation/training/least_squares.hpp"

#include <fmt/format.h>

#include <Eigen/Householder>
#include <Eigen/SVD>
#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <utility>

namespace prism::training {
namespace {

// A smaller pivot of a column of length 1 is rounding: the column is a combination of the others.
constexpr long double kDependent = 1e-10L;

double two_sided_p(double t, int df) {
  if (!std::isfinite(t)) return 0;
  using Plain = boost::math::policies::policy<boost::math::policies::promote_double<false>>;
  const boost::math::students_t_distribution<double, Plain> distribution(df);
  return 2 * boost::math::cdf(boost::math::complement(distribution, std::fabs(t)));
}

// R of the QR of `a`, column by column: only the number of rows is large, and Eigen's blocked QR in long double takes
// as long to compile as half of this module.
template <typename Matrix>
Matrix triangle_of(Matrix a) {
  const Eigen::Index size = std::min(a.rows(), a.cols());
  Matrix work(a.cols(), 1);
  for (Eigen::Index j = 0; j < size; ++j) {
    typename Matrix::Scalar tau, diagonal;
    auto rest = a.col(j).tail(a.rows() - j);
    rest.makeHouseholderInPlace(tau, diagonal);
    a(j, j) = diagonal;
    a.bottomRightCorner(a.rows() - j, a.cols() - j - 1)
        .applyHouseholderOnTheLeft(a.col(j).tail(a.rows() - j - 1), tau, work.data());
  }
  Matrix r = Matrix::Zero(a.cols(), a.cols());
  for (Eigen::Index j = 0; j < a.cols(); ++j)
    r.col(j).head(std::min(j + 1, size)) = a.col(j).head(std::min(j + 1, size));
  return r;
}

}  // namespace

double LinearFit::sd() const { return df > 0 ? std::sqrt(sse / df) : 0; }

LinearProblem::LinearProblem(const Eigen::MatrixXd& columns, const Eigen::VectorXd& y) : n_(y.size()) {
  const Eigen::Index m = columns.cols();
  Matrix all(n_, m + 1);
  all << columns.cast<long double>(), y.cast<long double>();
  mean_ = all.colwise().mean().transpose();
  all.rowwise() -= mean_.transpose();
  scale_ = all.colwise().norm().transpose();
  for (Eigen::Index j = 0; j <= m; ++j) {
    const long double noise = 1e-17L * std::fabs(mean_[j]) * std::sqrt(static_cast<long double>(n_));
    if (!(scale_[j] > noise)) scale_[j] = 0;
    all.col(j) *= scale_[j] > 0 ? 1 / scale_[j] : 0;
  }
  triangle_ = triangle_of(std::move(all));
}

Result<LinearFit> LinearProblem::fit(const std::vector<int>& subset) const {
  const auto m = static_cast<Eigen::Index>(subset.size());
  LinearFit fit;
  fit.df = static_cast<int>(n_ - 1 - m);
  if (fit.df < 0)
    return make_error("least squares", fmt::format("found {} samples, expected more than {} terms", n_, m));
  const Vector y = triangle_.rightCols(1);
  if (m == 0) {
    fit.intercept = static_cast<double>(mean_[mean_.size() - 1]);
    fit.sse = static_cast<double>(y.squaredNorm() * scale_.tail(1)[0] * scale_.tail(1)[0]);
    return fit;
  }
  Matrix stacked(triangle_.rows(), m + 1);
  stacked << triangle_(Eigen::all, subset), y;
  const Matrix r = triangle_of(std::move(stacked));
  for (Eigen::Index j = 0; j < m; ++j) {
    if (!(std::fabs(r(j, j)) > kDependent))
      return make_error("least squares",
                        fmt::format("term {} depends on the others", subset[static_cast<std::size_t>(j)] + 1));
  }
  const auto upper = r.topLeftCorner(m, m).template triangularView<Eigen::Upper>();
  const Vector beta = upper.solve(r.col(m).head(m));
  const long double y_scale = scale_.tail(1)[0];
  const long double sse = r(m, m) * r(m, m) * y_scale * y_scale;
  Matrix inverse(m, m);
  for (Eigen::Index j = 0; j < m; ++j) inverse.col(j) = upper.solve(Vector::Unit(m, j));
  const long double variance = fit.df > 0 ? sse / fit.df : 0;
  fit.sse = static_cast<double>(sse);
  fit.coefficient.resize(m);
  fit.standard_error.resize(m);
  fit.t.resize(m);
  fit.p.resize(m);
  long double intercept = mean_[mean_.size() - 1];
  for (Eigen::Index j = 0; j < m; ++j) {
    const int column = subset[static_cast<std::size_t>(j)];
    const long double coefficient = beta[j] * y_scale / scale_[column];
    const long double error = std::sqrt(variance) * inverse.row(j).norm() / scale_[column];
    intercept -= coefficient * mean_[column];
    fit.coefficient[j] = static_cast<double>(coefficient);
    fit.standard_error[j] = static_cast<double>(error);
    fit.t[j] = static_cast<double>(coefficient / error);
    fit.p[j] = fit.df > 0 ? two_sided_p(fit.t[j], fit.df) : 1;
  }
  fit.intercept = static_cast<double>(intercept);
  return fit;
}

// XᵀX of the raw columns from the triangle and the means: [N, N m; N m, RᵀR scaled + N m mᵀ], scaled to length 1. Its
// eigenvalues would be squares, so this decomposes the stacked form [√N, √N m; 0, R scale] instead.
double LinearProblem::condition(const std::vector<int>& subset) const {
  const auto m = static_cast<Eigen::Index>(subset.size());
  Matrix x = Matrix::Zero(triangle_.rows() + 1, m + 1);
  const long double root = std::sqrt(static_cast<long double>(n_));
  x(0, 0) = root;
  for (Eigen::Index j = 0; j < m; ++j) {
    const int column = subset[static_cast<std::size_t>(j)];
    x(0, j + 1) = root * mean_[column];
    x.col(j + 1).tail(triangle_.rows()) = triangle_.col(column) * scale_[column];
  }
  x.colwise().normalize();
  const Eigen::MatrixXd r = triangle_of(std::move(x)).cast<double>();
  const Eigen::VectorXd singular = Eigen::JacobiSVD<Eigen::MatrixXd, Eigen::NoQRPreconditioner>(r).singularValues();
  return singular[0] / singular[singular.size() - 1];
}

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::vector<int> with(std::vector<int> terms, int term) {
  terms.insert(std::upper_bound(terms.begin(), terms.end(), term), term);
  return terms;
}

std::vector<int> without(std::vector<int> terms, int term) {
  terms.erase(std::find(terms.begin(), terms.end(), term));
  return terms;
}

class StepwiseSearch {
 public:
  StepwiseSearch(const LinearProblem& problem, int count, const StepwiseSettings& settings)
      : problem_(problem), count_(count), settings_(settings), terms_(settings.start) {
    std::sort(terms_.begin(), terms_.end());
  }

  Result<StepwiseResult> run() {
    auto fit = problem_.fit(terms_);
    if (!fit) return tl::unexpected<Error>(fit.error());
    fit_ = std::move(*fit);
    path_.push_back({"initial", -1, 0, 0, {}, {}, terms_});
    const int limit = 100 + 10 * count_;
    for (int step = 0; step < limit; ++step) {
      if (add() || remove()) continue;
      path_.push_back({"stop", -1, 0, 0, candidate_p_, in_model_p(), terms_});
      return StepwiseResult{terms_, fit_, problem_.condition(terms_), path_};
    }
    return make_error(
        "stepwise",
        fmt::format("the terms do not converge after {} steps: increase p-remove or decrease p-enter", limit));
  }

 private:
  bool add() {
    candidate_p_.assign(static_cast<std::size_t>(count_), kNone);
    int best = -1;
    LinearFit best_fit;
    double best_p = settings_.p_enter, best_t = 0;
    for (int term = 0; term < count_; ++term) {
      if (std::binary_search(terms_.begin(), terms_.end(), term)) continue;
      const std::vector<int> trial = with(terms_, term);
      auto fit = problem_.fit(trial);
      if (!fit || fit->df < 1) continue;
      const auto at = std::find(trial.begin(), trial.end(), term) - trial.begin();
      const double p = candidate_p_[static_cast<std::size_t>(term)] = fit->p[at];
      if (!(p < best_p)) continue;
      best = term, best_p = p, best_t = fit->t[at];
      best_fit = std::move(*fit);
    }
    if (best < 0) return false;
    terms_ = with(terms_, best);
    fit_ = std::move(best_fit);
    path_.push_back({"add", best, best_p, best_t, candidate_p_, {}, terms_});
    return true;
  }

  bool remove() {
    if (terms_.empty()) return false;
    Eigen::Index worst = 0;
    const double p = fit_.p.maxCoeff(&worst);
    if (!(p > settings_.p_remove)) return false;
    const int term = terms_[static_cast<std::size_t>(worst)];
    StepwiseStep step{"remove", term, p, fit_.t[worst], candidate_p_, in_model_p(), {}};
    auto fit = problem_.fit(without(terms_, term));
    if (!fit) return false;
    terms_ = without(terms_, term);
    fit_ = std::move(*fit);
    step.terms = terms_;
    path_.push_back(std::move(step));
    return true;
  }

  std::vector<double> in_model_p() const {
    std::vector<double> p(static_cast<std::size_t>(count_), kNone);
    for (std::size_t i = 0; i < terms_.size(); ++i)
      p[static_cast<std::size_t>(terms_[i])] = fit_.p[static_cast<Eigen::Index>(i)];
    return p;
  }

  const LinearProblem& problem_;
  int count_;
  const StepwiseSettings& settings_;
  std::vector<int> terms_;
  LinearFit fit_;
  std::vector<double> candidate_p_;
  std::vector<StepwiseStep> path_;
};

}  // namespace

Result<StepwiseResult> fit_stepwise(const Eigen::MatrixXd& columns, const Eigen::VectorXd& y,
                                    const StepwiseSettings& settings) {
  if (!(settings.p_enter > 0 && settings.p_enter <= settings.p_remove && settings.p_remove <= 1)) {
    return make_error("stepwise", fmt::format("found p-enter {} and p-remove {}, expected 0 < p-enter <= p-remove <= 1",
                                              settings.p_enter, settings.p_remove));
  }
  if (columns.rows() < 3)
    return make_error("stepwise", fmt::format("found {} samples, expected at least 3", columns.rows()));
  const LinearProblem problem(columns, y);
  return StepwiseSearch(problem, static_cast<int>(columns.cols()), settings).run();
}

}  // namespace prism::training
