// SPDX-License-Identifier: MIT
#include "compensation/training/lssvm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "compensation/training/dense.hpp"

namespace prism::training {
namespace {

std::vector<std::vector<Eigen::Index>> members(const std::vector<int>& folds) {
  std::vector<std::vector<Eigen::Index>> lists(
      static_cast<std::size_t>(*std::max_element(folds.begin(), folds.end()) + 1));
  for (std::size_t i = 0; i < folds.size(); ++i)
    lists[static_cast<std::size_t>(folds[i])].push_back(static_cast<Eigen::Index>(i));
  return lists;
}

}  // namespace

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

Eigen::VectorXd LssvmFactor::leave_fold_out(const std::vector<int>& folds) const {
  Eigen::VectorXd unused;
  return leave_fold_out(folds, unused);
}

Eigen::VectorXd LssvmFactor::leave_fold_out(const std::vector<int>& folds, Eigen::VectorXd& variance) const {
  const Eigen::MatrixXd& w = inverse_factor();
  Eigen::VectorXd held_out(y_.size());
  variance.resize(y_.size());
  for (const auto& fold : members(folds)) {
    if (fold.empty()) continue;
    const auto n = static_cast<Eigen::Index>(fold.size());
    const Eigen::MatrixXd columns = w(Eigen::all, fold).transpose();
    Eigen::MatrixXd c = Eigen::MatrixXd::Zero(n, n);
    add_gram(columns, c);
    Eigen::VectorXd alpha = solution_.alpha(fold), nu = nu_(fold);
    c -= nu * nu.transpose() / ones_;
    if (!cholesky(c)) {
      held_out(fold).setConstant(std::numeric_limits<double>::infinity());
      variance(fold).setConstant(std::numeric_limits<double>::infinity());
      continue;
    }
    solve_cholesky(c, alpha);
    held_out(fold) = alpha;
    variance(fold) = inverse_lower(c).colwise().squaredNorm().transpose();
  }
  return held_out;
}

double LssvmFactor::degrees_of_freedom() const {
  return static_cast<double>(y_.size()) - diagonal_of_c().dot(inverse_cv_);
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
  const Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic> x = points.cast<long double>();
  const long double gamma = 1 / (2 * static_cast<long double>(sigma2));
  ExtendedMatrix k(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    k(j, j) = 1;
    for (Eigen::Index i = j + 1; i < n; ++i) k(i, j) = k(j, i) = std::exp(-gamma * (x.col(i) - x.col(j)).squaredNorm());
  }
  return k;
}

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

}  // namespace prism::training
