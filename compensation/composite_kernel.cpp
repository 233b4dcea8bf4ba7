// SPDX-License-Identifier: MIT
#include "compensation/composite_kernel.hpp"

#include <utility>

namespace prism::compensation {

double CompositeKernel::variance(const Eigen::VectorXd& x) const {
  const double square = x.squaredNorm();
  return rbf + linear * square + quadratic * square * square;
}

Eigen::MatrixXd CompositeKernel::smooth_matrix(const Eigen::MatrixXd& points) const {
  const Eigen::MatrixXd scaled = length2.cwiseSqrt().cwiseInverse().asDiagonal() * points;
  return rbf * kernel_matrix(scaled, {});
}

Eigen::MatrixXd CompositeKernel::matrix(const Eigen::MatrixXd& points) const {
  Eigen::MatrixXd k = smooth_matrix(points);
  const Eigen::ArrayXXd dots = (points.transpose() * points).array();
  k.array() += linear * dots + quadratic * dots.square();
  return k;
}

CompositeCentres::CompositeCentres(CompositeKernel kernel, const Eigen::MatrixXd& centres)
    : kernel_(std::move(kernel)),
      points_(centres),
      inverse_length_(kernel_.length2.cwiseSqrt().cwiseInverse()),
      centres_(inverse_length_.asDiagonal() * centres, {}) {}

void CompositeCentres::weigh(const Eigen::VectorXd& alpha) {
  alpha_ = kernel_.rbf * alpha;
  linear_ = kernel_.linear * (points_ * alpha);
  quadratic_ = kernel_.quadratic * (points_ * alpha.asDiagonal() * points_.transpose());
}

double CompositeCentres::sum(const Eigen::VectorXd& x) const {
  const Eigen::VectorXd scaled = x.cwiseProduct(inverse_length_);
  return centres_.sum({scaled.data(), static_cast<std::size_t>(scaled.size())}, alpha_) + linear_.dot(x) +
         x.dot(quadratic_ * x);
}

Eigen::VectorXd CompositeCentres::row(const Eigen::VectorXd& x) const {
  const Eigen::VectorXd scaled = x.cwiseProduct(inverse_length_);
  Eigen::VectorXd k(points_.cols());
  centres_.row({scaled.data(), static_cast<std::size_t>(scaled.size())}, k.data());
  const Eigen::ArrayXd dots = (points_.transpose() * x).array();
  k = kernel_.rbf * k.array() + kernel_.linear * dots + kernel_.quadratic * dots.square();
  return k;
}

}  // namespace prism::compensation
