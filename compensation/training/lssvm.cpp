// SPDX-License-Identifier: MIT
#include "compensation/training/lssvm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "compensation/training/dense.hpp"

namespace prism::training {

Result<LssvmFactor> LssvmFactor::make(Eigen::MatrixXd kernel, const Eigen::VectorXd& inverse_cv,
                                      const Eigen::VectorXd& y) {
  LssvmFactor f;
  f.factor_ = std::move(kernel);
  f.factor_.diagonal() += inverse_cv;
  if (!cholesky(f.factor_)) {
    return make_error("LSSVM",
                      "the kernel matrix is not positive definite in double precision: c is too large for this sigma2");
  }
  f.inverse_cv_ = inverse_cv;
  f.y_ = y;
  f.nu_ = Eigen::VectorXd::Ones(y.size());
  solve_cholesky(f.factor_, f.nu_);
  f.ones_ = f.nu_.sum();
  f.solution_ = f.solve(y);
  if (!(f.ones_ > 0) || !f.solution_.alpha.allFinite()) return make_error("LSSVM", "the system has no finite solution");
  return f;
}

LssvmSolution LssvmFactor::solve(const Eigen::VectorXd& y, double top) const {
  LssvmSolution s;
  s.alpha = y;
  solve_cholesky(factor_, s.alpha);
  s.b = (nu_.dot(y) - top) / ones_;
  s.alpha -= nu_ * s.b;
  return s;
}

const Eigen::MatrixXd& LssvmFactor::inverse_factor() const {
  if (inverse_.size() == 0) inverse_ = inverse_lower(factor_);
  return inverse_;
}

Eigen::VectorXd LssvmFactor::diagonal_of_c() const {
  return inverse_factor().colwise().squaredNorm().transpose() - nu_.cwiseAbs2() / ones_;
}

Eigen::VectorXd LssvmFactor::leave_one_out() const { return solution_.alpha.cwiseQuotient(diagonal_of_c()); }

Eigen::VectorXd LssvmFactor::leave_fold_out(const Folds& folds, Eigen::VectorXd* variance) const {
  const Eigen::MatrixXd& w = inverse_factor();
  Eigen::VectorXd held_out = Eigen::VectorXd::Constant(y_.size(), std::numeric_limits<double>::infinity());
  if (variance) *variance = held_out;
  for (const Rows& fold : fold_members(folds)) {
    if (fold.empty()) continue;
    const Eigen::MatrixXd columns = w(Eigen::all, fold).transpose();
    Eigen::MatrixXd c = Eigen::MatrixXd::Zero(columns.rows(), columns.rows());
    add_gram(columns, c);
    Eigen::VectorXd alpha = solution_.alpha(fold), nu = nu_(fold);
    c -= nu * nu.transpose() / ones_;
    if (!cholesky(c)) continue;
    solve_cholesky(c, alpha);
    held_out(fold) = alpha;
    if (variance) (*variance)(fold) = inverse_lower(c).colwise().squaredNorm().transpose();
  }
  return held_out;
}

double LssvmFactor::prior_variance() const { return y_.dot(solution_.alpha) / static_cast<double>(y_.size() - 1); }

double LssvmFactor::restricted_log_likelihood() const {
  const double n1 = static_cast<double>(y_.size() - 1);
  const double log_det = 2 * factor_.diagonal().array().log().sum();
  return -0.5 * (n1 * std::log(2 * std::numbers::pi * prior_variance()) + log_det + std::log(ones_) + n1);
}

Eigen::VectorXd LssvmFactor::variance_fractions() const {
  return inverse_cv_.array() - inverse_cv_.array().square() * diagonal_of_c().array();
}

ExtendedMatrix extended_kernel_matrix(const Eigen::MatrixXd& points, double sigma2) {
  const Eigen::Index n = points.cols();
  const ExtendedMatrix x = points.cast<long double>();
  const long double gamma = 1 / (2 * static_cast<long double>(sigma2));
  ExtendedMatrix k(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    k(j, j) = 1;
    for (Eigen::Index i = j + 1; i < n; ++i) k(i, j) = k(j, i) = std::exp(-gamma * (x.col(i) - x.col(j)).squaredNorm());
  }
  return k;
}

namespace {

// Refines a solution with residuals in extended precision until they stagnate, so that it does not depend on the
// machine. Up to 12 steps, O(N²) each.
void refine(const ExtendedMatrix& kernel, const Eigen::VectorXd& inverse_cv, const Eigen::VectorXd& y,
            const LssvmFactor& factor, LssvmSolution& solution) {
  using Extended = long double;
  Eigen::Matrix<Extended, Eigen::Dynamic, 1> alpha = solution.alpha.cast<Extended>();
  Extended b = solution.b;
  double last = std::numeric_limits<double>::infinity();
  constexpr int kMaxSteps = 12;
  for (int steps = 0; steps < kMaxSteps; ++steps) {
    Eigen::VectorXd residual(y.size());
    for (Eigen::Index i = 0; i < y.size(); ++i) {
      const Extended sum = kernel.col(i).dot(alpha) + b + inverse_cv[i] * alpha[i];
      residual[i] = static_cast<double>(y[i] - sum);
    }
    const LssvmSolution step = factor.solve(residual, static_cast<double>(-alpha.sum()));
    const double size = step.alpha.norm();
    if (!(size < 0.5 * last)) break;  // stagnation, or the factor is too ill-conditioned: keeps the last solution
    last = size;
    alpha += step.alpha.cast<Extended>();
    b += step.b;
    if (size <= 1e-17 * solution.alpha.norm()) break;
  }
  solution.alpha = alpha.cast<double>();
  solution.b = static_cast<double>(b);
}

// A weight of zero makes 1/(c v) infinite: the sample is removed from the system, alpha = 0 (eq. 16 in eq. 14).
Result<IrlssvmFit> solve_weighted(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c,
                                  const Eigen::VectorXd& weight, const ExtendedMatrix* extended) {
  Rows kept;
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    if (weight[i] > 0) kept.push_back(i);
  }
  if (kept.size() < 2)
    return make_error("IR-LSSVM",
                      fmt::format("{} of {} samples have a weight, expected at least 2", kept.size(), y.size()));
  const Eigen::VectorXd inverse_cv = 1 / (c * weight(kept).array());
  auto factor = LssvmFactor::make(kernel(kept, kept), inverse_cv, y(kept));
  if (!factor) return tl::unexpected<Error>(factor.error());
  LssvmSolution inside = factor->solution(), solution{Eigen::VectorXd::Zero(y.size()), 0};
  if (extended) refine((*extended)(kept, kept), inverse_cv, y(kept), *factor, inside);
  solution.alpha(kept) = inside.alpha;
  solution.b = inside.b;
  Eigen::VectorXd residual = y - kernel * solution.alpha;
  residual.array() -= solution.b;
  residual(kept) = inside.alpha.cwiseProduct(inverse_cv);
  return IrlssvmFit{std::move(solution), weight, std::move(residual), std::move(kept), std::move(*factor), {}};
}

}  // namespace

Result<IrlssvmFit> fit_irlssvm(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c,
                               const ReweightSettings& settings) {
  constexpr double kRounding = 2e-16;
  constexpr int kPatience = 20;
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(y.size());
  std::optional<IrlssvmFit> fit;
  Eigen::VectorXd last, before;  // alpha of the two solves before
  double last_change = std::numeric_limits<double>::infinity();
  const auto solve = [&](const Eigen::VectorXd& v) -> Result<Eigen::VectorXd> {
    auto next = solve_weighted(kernel, y, c, v, settings.extended);
    if (!next) return tl::unexpected<Error>(next.error());
    before = std::move(last);
    if (fit) last = std::move(fit->solution.alpha);
    fit.emplace(std::move(*next));
    return fit->residual;
  };
  const auto rule = [&](const ReweightStep&, ReweightReport& report) {
    const Eigen::VectorXd& alpha = fit->solution.alpha;
    const double change = (alpha - last).norm(), previous = std::exchange(last_change, change);
    const bool averaged = report.oscillating;
    // Alternation between two states: successive solutions differ, but every second one is the same.
    if (settings.tolerance > 0 && report.solves >= kPatience && (alpha - before).norm() < 1e-3 * change)
      report.oscillating = true;
    // A change below the smallest that the system can resolve in double precision is noise if it no longer decreases.
    const double floor = kRounding * c * static_cast<double>(alpha.size()) * alpha.norm();
    if (change <= settings.tolerance || (change <= floor && change > 0.8 * previous)) return AfterStep::kConverged;
    return averaged ? AfterStep::kStop : AfterStep::kContinue;
  };
  auto report = reweight(settings, weight, solve, rule);
  if (!report) return tl::unexpected<Error>(report.error());
  fit->report = *report;
  return std::move(*fit);
}

void refine_fit(const ExtendedMatrix& kernel, double c, const Eigen::VectorXd& y, IrlssvmFit& fit) {
  const Eigen::VectorXd inverse_cv = 1 / (c * fit.weight(fit.kept).array());
  LssvmSolution kept{fit.solution.alpha(fit.kept), fit.solution.b};
  refine(kernel(fit.kept, fit.kept), inverse_cv, y(fit.kept), fit.factor, kept);
  fit.solution.alpha(fit.kept) = kept.alpha;
  fit.solution.b = kept.b;
  fit.residual(fit.kept) = kept.alpha.cwiseProduct(inverse_cv);
}

namespace {

CrossValidation fold_costs(const Eigen::VectorXd& residual, const Folds& folds, double scale) {
  CrossValidation cv;
  cv.residual = residual * scale;
  for (const Rows& fold : fold_members(folds)) {
    const Eigen::VectorXd held_out = cv.residual(fold);
    cv.fold_mse.push_back(held_out.squaredNorm() / static_cast<double>(held_out.size()));
    cv.fold_mae.push_back(held_out.cwiseAbs().mean());
  }
  const double n = static_cast<double>(cv.fold_mse.size());
  cv.mse = std::accumulate(cv.fold_mse.begin(), cv.fold_mse.end(), 0.0) / n;
  cv.mae = std::accumulate(cv.fold_mae.begin(), cv.fold_mae.end(), 0.0) / n;
  return cv;
}

}  // namespace

Result<CrossValidation> cross_validate(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c,
                                       const Folds& folds, double scale) {
  const auto factor = LssvmFactor::make(kernel, Eigen::VectorXd::Constant(y.size(), 1 / c), y);
  if (!factor) return tl::unexpected<Error>(factor.error());
  if (!folds.empty()) return fold_costs(factor->leave_fold_out(folds), folds, scale);
  CrossValidation cv;
  cv.residual = factor->leave_one_out() * scale;
  cv.mse = cv.residual.squaredNorm() / static_cast<double>(y.size());
  cv.mae = cv.residual.cwiseAbs().mean();
  return cv;
}

Result<CrossValidation> cross_validate_robust(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c,
                                              const ReweightSettings& settings, const Folds& folds, double scale) {
  std::vector<int> solves;
  std::optional<Error> failed;
  const Eigen::VectorXd residual = held_out(folds, [&](const Rows& rest, const Rows& members) -> Eigen::VectorXd {
    ReweightSettings inside = settings;
    ExtendedMatrix extended;
    if (settings.extended) inside.extended = &(extended = (*settings.extended)(rest, rest));
    const auto fit = fit_irlssvm(kernel(rest, rest), y(rest), c, inside);
    if (!fit) {
      failed = fit.error();
      return {};
    }
    solves.push_back(fit->report.solves);
    const Eigen::MatrixXd across = kernel(rest, members);
    return y(members) - across.transpose() * fit->solution.alpha -
           Eigen::VectorXd::Constant(across.cols(), fit->solution.b);
  });
  if (failed) return tl::unexpected<Error>(*failed);
  CrossValidation cv = fold_costs(residual, folds, scale);
  cv.fold_solves = std::move(solves);
  return cv;
}

}  // namespace prism::training
