// SPDX-License-Identifier: MIT
#include "compensation/posterior_variance.hpp"

#include <algorithm>
#include <utility>

#include "compensation/factor.hpp"

namespace prism::compensation {

std::optional<PosteriorVariance> PosteriorVariance::dense(Eigen::MatrixXd covariance) {
  PosteriorVariance v;
  v.factor_ = std::move(covariance);
  if (!lower_factor(v.factor_)) return std::nullopt;
  v.nu_ = Eigen::VectorXd::Ones(v.factor_.rows());
  solve_factored(v.factor_, v.nu_);
  v.ones_ = v.nu_.sum();
  if (!(v.ones_ > 0)) return std::nullopt;
  return v;
}

std::optional<PosteriorVariance> PosteriorVariance::sparse(Eigen::MatrixXd kernel, Eigen::MatrixXd gram, double c) {
  PosteriorVariance v;
  v.factor_ = std::move(kernel);
  v.gram_factor_ = std::move(gram);
  v.c_ = c;
  if (!lower_factor(v.factor_) || !lower_factor(v.gram_factor_)) return std::nullopt;
  return v;
}

double PosteriorVariance::at(Eigen::VectorXd k, double prior) const {
  if (gram_factor_.size() == 0) {
    const double level = 1 - nu_.dot(k);
    solve_factor(factor_, k);
    return std::max(0.0, prior - k.squaredNorm() + level * level / ones_);
  }
  solve_factor(factor_, k);
  Eigen::VectorXd phi(k.size() + 1);
  phi << k, 1.0;
  solve_factor(gram_factor_, phi);
  return std::max(0.0, prior - k.squaredNorm()) + phi.squaredNorm() / c_;
}

}  // namespace prism::compensation
