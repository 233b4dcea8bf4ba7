// SPDX-License-Identifier: MIT
#include "compensation/training/composite_sparse.hpp"

#include <algorithm>
#include <cmath>

#include "compensation/training/composite_search.hpp"
#include "compensation/training/dense.hpp"
#include "compensation/training/nuisance_filter.hpp"

namespace prism::training {
namespace {

constexpr Eigen::Index kPivotSamples = 4000, kPiece = 1024;
constexpr double kLeftOfNoise = 1e-3;  // what the centres may leave of the kernel, in noise variances

struct Pivots {
  std::vector<Eigen::Index> chosen;
  double left = 0;
};

// Pivoted Cholesky of the kernel matrix over every n-th sample.
Pivots choose_centres(const compensation::CompositeVariances& v, const Eigen::MatrixXd& points, Eigen::Index max_rank) {
  const std::vector<Eigen::Index> tried = thinned(points.cols(), kPivotSamples);
  const auto n = static_cast<Eigen::Index>(tried.size());
  const Eigen::MatrixXd x = points(Eigen::all, tried);
  const compensation::CompositeCentres centres(v.kernel, x);
  Eigen::VectorXd left(n);
  for (Eigen::Index i = 0; i < n; ++i) left[i] = v.kernel.variance(x.col(i));
  const Eigen::Index most = std::min(max_rank, n);
  Eigen::MatrixXd rows(n, most);
  Pivots pivots;
  for (Eigen::Index r = 0; r < most; ++r) {
    Eigen::Index next = 0;
    pivots.left = left.maxCoeff(&next);
    if (!(pivots.left > kLeftOfNoise * v.noise)) break;
    rows.col(r) =
        (centres.row(x.col(next)) - rows.leftCols(r) * rows.row(next).head(r).transpose()) / std::sqrt(pivots.left);
    left -= rows.col(r).cwiseAbs2();
    left[next] = 0;
    pivots.chosen.push_back(tried[static_cast<std::size_t>(next)]);
  }
  pivots.left = left.maxCoeff();
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
                                                    const ReweightSettings& settings, Eigen::Index max_rank) {
  const compensation::CompositeVariances variances = composite_variances(theta, samples.x.rows());
  Pivots pivots = choose_centres(variances, samples.x, max_rank);
  SparseSystem system(samples, variances, std::move(pivots.chosen));
  if (!system.prepare()) return std::nullopt;
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(samples.y.size());
  if (!system.solve(weight)) return std::nullopt;
  ReweightReport report;
  report.converged = settings.weight.kind == WeightKind::kNone;
  while (!report.converged && report.solves < std::min(settings.limit, 30)) {
    report.scale = robust_scale(system.noise_residual(), settings.scale);
    const Eigen::VectorXd next = weights_of(system.noise_residual(), report.scale, settings.weight).cwiseMax(1e-7);
    report.change.push_back((next - weight).cwiseAbs().maxCoeff());
    report.converged = report.change.back() < kStillWeight;
    weight = next;
    ++report.solves;
    if (!system.solve(weight)) return std::nullopt;
  }
  return system.result(std::move(weight), std::move(report), pivots.left);
}

}  // namespace prism::training
