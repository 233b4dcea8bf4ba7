// SPDX-License-Identifier: MIT
#include "compensation/training/composite_sparse.hpp"

#include <algorithm>
#include <cmath>

#include "compensation/training/composite_search.hpp"
#include "compensation/training/dense.hpp"
#include "compensation/training/nuisance_filter.hpp"
#include "compensation/training/pivoted_cholesky.hpp"

namespace prism::training {
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
