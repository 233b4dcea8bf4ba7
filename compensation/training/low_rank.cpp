// SPDX-License-Identifier: MIT
#include "compensation/training/low_rank.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <random>

#include "compensation/kernel.hpp"
#include "compensation/training/dense.hpp"

namespace prism::training {

LowRank pivoted_cholesky(Eigen::VectorXd diagonal, const KernelRow& row, double tolerance, Eigen::Index max_rank) {
  const Eigen::Index n = diagonal.size();
  LowRank p;
  p.phi.resize(std::min<Eigen::Index>(64, max_rank + 1), n);
  Eigen::VectorXd k(n);
  while (p.rank() < max_rank) {
    Eigen::Index next = 0;
    p.left = diagonal.maxCoeff(&next);
    if (!(p.left > tolerance)) break;
    const Eigen::Index r = p.rank();
    if (r + 1 >= p.phi.rows()) p.phi.conservativeResize(std::min(2 * p.phi.rows(), max_rank + 1), n);
    row(next, k);
    const Eigen::VectorXd own = p.phi.col(next).head(r);
    const double root = std::sqrt(p.left);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double value = (k[i] - p.phi.col(i).head(r).dot(own)) / root;
      p.phi(r, i) = value;
      diagonal[i] -= value * value;
    }
    diagonal[next] = 0;
    p.pivots.push_back(next);
    p.left_before.push_back(p.left);
  }
  p.left = diagonal.maxCoeff();
  p.phi.conservativeResize(p.rank() + 1, n);
  p.phi.row(p.rank()).setOnes();
  return p;
}

namespace {

constexpr double kRounding = 1e-14;  // a smaller diagonal entry is rounding, and its root would be noise

LowRank pivot(const Eigen::MatrixXd& points, double sigma2, double tolerance, Eigen::Index max_rank) {
  const compensation::KernelCentres centres(points, sigma2);
  return pivoted_cholesky(
      Eigen::VectorXd::Ones(points.cols()),
      [&](Eigen::Index i, Eigen::VectorXd& k) { centres.row(points.col(i), k.data()); }, std::max(tolerance, kRounding),
      max_rank);
}

Rows drawn(Eigen::Index n, Eigen::Index count, std::uint64_t seed) {
  Rows all(static_cast<std::size_t>(n));
  std::iota(all.begin(), all.end(), Eigen::Index{0});
  std::mt19937_64 random(seed);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
    std::swap(all[i], all[i + random() % (all.size() - i)]);
  all.resize(static_cast<std::size_t>(count));
  std::sort(all.begin(), all.end());
  return all;
}

// φ(x) = L⁻¹ k(x) for every point, L the factor over the pivots.
Eigen::MatrixXd features_of(const Eigen::MatrixXd& points, const Rows& pivots, double sigma2) {
  const auto r = static_cast<Eigen::Index>(pivots.size());
  const Eigen::MatrixXd chosen = points(Eigen::all, pivots), l = pivot_factor(chosen, sigma2);
  if (l.size() == 0) return {};
  Eigen::MatrixXd phi(r + 1, points.cols());
  const compensation::KernelCentres centres(chosen, sigma2);
  Eigen::VectorXd k(r);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    centres.row(points.col(i), k.data());
    solve_lower(l, k);
    phi.col(i).head(r) = k;
  }
  phi.row(r).setOnes();
  return phi;
}

}  // namespace

Eigen::MatrixXd pivot_factor(const Eigen::MatrixXd& pivots, double sigma2) {
  Eigen::MatrixXd l = compensation::kernel_matrix(pivots, sigma2);
  l.diagonal().array() += 1e-15;
  return cholesky(l) ? l : Eigen::MatrixXd();
}

LowRank low_rank(const Eigen::MatrixXd& points, double sigma2, double tolerance, Eigen::Index max_rank,
                 std::uint64_t seed) {
  max_rank = std::min(max_rank, points.cols());
  if (points.cols() <= kPivotSample) return pivot(points, sigma2, tolerance, max_rank);
  const Rows sample = drawn(points.cols(), kPivotSample, seed);
  const LowRank p = pivot(points(Eigen::all, sample), sigma2, std::max(tolerance, 1e-12), max_rank);
  LowRank result;
  for (const Eigen::Index i : p.pivots) result.pivots.push_back(sample[static_cast<std::size_t>(i)]);
  result.phi = features_of(points, result.pivots, sigma2);
  if (result.phi.size() > 0)
    result.left = (1 - result.phi.topRows(result.rank()).colwise().squaredNorm().array()).maxCoeff();
  return result;
}

LowRank coarser(const LowRank& fine, double tolerance) {
  assert(fine.left_before.size() == fine.pivots.size());
  const auto stop = std::find_if(fine.left_before.begin(), fine.left_before.end(),
                                 [&](double left) { return !(left > std::max(tolerance, kRounding)); });
  const auto r = static_cast<Eigen::Index>(stop - fine.left_before.begin());
  LowRank result{{fine.pivots.begin(), fine.pivots.begin() + r},
                 Eigen::MatrixXd(r + 1, fine.phi.cols()),
                 fine.left,
                 {fine.left_before.begin(), stop}};
  if (stop != fine.left_before.end()) result.left = *stop;
  result.phi << fine.phi.topRows(r), fine.phi.bottomRows(1);
  return result;
}

Eigen::MatrixXd PrimalLssvm::gram(const Eigen::VectorXd& weight) const {
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(system_.phi.rows(), system_.phi.rows());
  add_gram(system_.phi, gram, &weight);
  return gram;
}

bool PrimalLssvm::solve(const Eigen::VectorXd& weight) {
  return solve(gram(weight), system_.phi * weight.cwiseProduct(y_));
}

bool PrimalLssvm::solve(const Eigen::MatrixXd& gram, const Eigen::VectorXd& moment) {
  factor_ = gram;
  factor_.diagonal().head(system_.rank()).array() += 1 / c_;
  if (!cholesky(factor_)) return false;
  theta_ = moment;
  solve_cholesky(factor_, theta_);
  return theta_.allFinite();
}

Eigen::VectorXd PrimalLssvm::leverages() const {
  Eigen::VectorXd h(y_.size()), z;
  for (Eigen::Index i = 0; i < h.size(); ++i) {
    z = system_.phi.col(i);
    solve_lower(factor_, z);
    h[i] = z.squaredNorm();
  }
  return h;
}

}  // namespace prism::training
