// SPDX-License-Identifier: MIT
#include "compensation/training/least_squares.hpp"

#include <fmt/format.h>

#include <Eigen/Householder>
#include <Eigen/SVD>
#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
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

}  // namespace prism::training
