// SPDX-License-Identifier: MIT
#include "compensation/kernel.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>
#include <utility>

#include "compensation/kernels/kernels.hpp"
#include "compensation/model.hpp"

namespace prism::compensation {
namespace {

kernels::Points from(const Eigen::MatrixXd& inputs, Eigen::Index first) {
  const auto rows = static_cast<std::size_t>(inputs.rows()), columns = static_cast<std::size_t>(inputs.cols());
  return {inputs.data() + first, rows, columns, rows - static_cast<std::size_t>(first)};
}

}  // namespace

KernelCentres::KernelCentres(const Eigen::MatrixXd& centres, double sigma2)
    : gamma_(0.5 / sigma2), inputs_(centres.transpose()) {}

double KernelCentres::sum(const Eigen::VectorXd& point, const Eigen::VectorXd& alpha) const {
  assert(point.size() == inputs_.cols() && alpha.size() == inputs_.rows());
  return kernels::rbf_sum(from(inputs_, 0), point.data(), gamma_, alpha.data());
}

void KernelCentres::row(const Eigen::Ref<const Eigen::VectorXd>& point, double* row, Eigen::Index first) const {
  assert(point.size() == inputs_.cols() && first <= inputs_.rows());
  kernels::rbf_row(from(inputs_, first), point.data(), gamma_, row);
}

// In blocks, so that both sides of the mirrored copy stay in the cache; a column is computed from its own block down.
Eigen::MatrixXd kernel_matrix(const Eigen::MatrixXd& points, double sigma2) {
  constexpr Eigen::Index kBlock = 32;
  const Eigen::Index n = points.cols();
  const KernelCentres centres(points, sigma2);
  Eigen::MatrixXd k(n, n);
  for (Eigen::Index first = 0; first < n; first += kBlock) {
    const Eigen::Index end = std::min(first + kBlock, n);
    for (Eigen::Index j = first; j < end; ++j) centres.row(points.col(j), k.col(j).data() + first, first);
    for (Eigen::Index i = end; i < n; i += kBlock) {
      const Eigen::Index rows = std::min(kBlock, n - i);
      k.block(first, i, end - first, rows) = k.block(i, first, rows, end - first).transpose();
    }
  }
  return k;
}

double CompositeKernel::variance(const Eigen::VectorXd& x) const {
  const double square = x.squaredNorm();
  return rbf + linear * square + quadratic * square * square;
}

Eigen::MatrixXd CompositeKernel::smooth_matrix(const Eigen::MatrixXd& points) const {
  const Eigen::MatrixXd scaled = length2.cwiseSqrt().cwiseInverse().asDiagonal() * points;
  return rbf * kernel_matrix(scaled, 1);
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
      centres_(inverse_length_.asDiagonal() * centres, 1) {}

void CompositeCentres::weigh(const Eigen::VectorXd& alpha) {
  alpha_ = kernel_.rbf * alpha;
  linear_ = kernel_.linear * (points_ * alpha);
  quadratic_ = kernel_.quadratic * (points_ * alpha.asDiagonal() * points_.transpose());
}

double CompositeCentres::sum(const Eigen::VectorXd& x) const {
  return centres_.sum(x.cwiseProduct(inverse_length_), alpha_) + linear_.dot(x) + x.dot(quadratic_ * x);
}

Eigen::VectorXd CompositeCentres::row(const Eigen::VectorXd& x) const {
  Eigen::VectorXd k(points_.cols());
  centres_.row(x.cwiseProduct(inverse_length_), k.data());
  const Eigen::ArrayXd dots = (points_.transpose() * x).array();
  k = kernel_.rbf * k.array() + kernel_.linear * dots + kernel_.quadratic * dots.square();
  return k;
}

namespace {

constexpr Eigen::Index kMaxCentres = 8000;

}  // namespace

std::string exact_numbers(const Eigen::MatrixXd& matrix) {
  return exact_texts({matrix.data(), static_cast<std::size_t>(matrix.size())});
}

Eigen::VectorXd Normalisation::of(std::span<const double> inputs) const {
  assert(std::ssize(inputs) == input_shift.size());
  const Eigen::Map<const Eigen::VectorXd> x(inputs.data(), input_shift.size());
  return (x - input_shift).cwiseQuotient(input_scale);
}

std::string wrong_centres(const ModelInfo& info, const Normalisation& normalisation, const Eigen::MatrixXd& centres,
                          Eigen::Index alphas) {
  const auto d = static_cast<Eigen::Index>(info.inputs.size()), n = centres.cols();
  if (centres.rows() != d || n < 1)
    return fmt::format("found {} inputs for each of {} centres, expected {}", centres.rows(), n, d);
  if (n > kMaxCentres)
    return fmt::format("found {} centres, expected at most {}: more need gigabytes of memory", n, kMaxCentres);
  if (alphas != n) return fmt::format("found {} alphas, expected {}", alphas, n);
  const Eigen::Index shifts = normalisation.input_shift.size(), scales = normalisation.input_scale.size();
  if (shifts != d || scales != d)
    return fmt::format("found {} input shifts and {} input scales, expected {}", shifts, scales, d);
  return {};
}

namespace {

// Eigen chooses its block sizes by the caches, which changes a factor's last bits. This fixes them before first use.
[[maybe_unused]] const bool kSameCachesEverywhere = [] {
  Eigen::setCpuCacheSizes(32 << 10, 256 << 10, 2 << 20);
  return true;
}();

}  // namespace

bool lower_factor(Eigen::MatrixXd& matrix) {
  Eigen::Ref<Eigen::MatrixXd> in_place(matrix);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(in_place);
  return llt.info() == Eigen::Success && matrix.diagonal().allFinite();
}

void solve_factor(const Eigen::MatrixXd& factor, Eigen::VectorXd& x) {
  factor.triangularView<Eigen::Lower>().solveInPlace(x);
}

void solve_factored(const Eigen::MatrixXd& factor, Eigen::VectorXd& x) {
  solve_factor(factor, x);
  factor.triangularView<Eigen::Lower>().transpose().solveInPlace(x);
}

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
