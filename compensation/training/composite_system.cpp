// SPDX-License-Identifier: MIT
#include "compensation/training/composite_system.hpp"

#include <cmath>

#include "compensation/training/dense.hpp"
#include "compensation/training/folds.hpp"

namespace prism::training {
namespace {

constexpr double kPrior = 0.005;  // factor of |theta|²

}  // namespace

CompositeSamples CompositeSamples::part(const std::vector<Eigen::Index>& rows) const {
  return {x(Eigen::all, rows), y(rows), time_h(rows), taken(recording, rows), recordings, warm_up};
}

Eigen::VectorXd composite_theta(const compensation::CompositeVariances& v, bool offsets) {
  const Eigen::Index d = v.kernel.length2.size();
  Eigen::VectorXd theta(d + (offsets ? 7 : 6));
  theta[0] = v.kernel.rbf;
  theta.segment(1, d) = v.kernel.length2;
  theta.segment(1 + d, 5) << v.kernel.linear, v.kernel.quadratic, v.nuisance, v.nuisance_time_h, v.noise;
  if (offsets) theta[6 + d] = v.offset;
  return theta.array().log();
}

compensation::CompositeVariances composite_variances(const Eigen::VectorXd& theta, Eigen::Index d) {
  const Eigen::VectorXd value = theta.array().exp();
  compensation::CompositeVariances v;
  v.kernel = {value[0], value.segment(1, d), value[1 + d], value[2 + d]};
  v.nuisance = value[3 + d];
  v.nuisance_time_h = value[4 + d];
  v.noise = value[5 + d];
  v.offset = theta.size() > 6 + d ? value[6 + d] : 0;
  return v;
}

std::optional<CompositeSystem> CompositeSystem::make(const CompositeSamples& samples, const Eigen::VectorXd& theta,
                                                     const Eigen::VectorXd& weight) {
  CompositeSystem s;
  s.samples_ = &samples;
  s.theta_ = theta;
  s.weight_ = weight;
  s.variances_ = composite_variances(theta, samples.x.rows());
  const compensation::CompositeKernel& kernel = s.variances_.kernel;
  s.smooth_ = kernel.smooth_matrix(samples.x);
  s.nuisance_ = compensation::nuisance_matrix(s.variances_, samples.time_h, samples.recording);
  const Eigen::ArrayXXd dots = (samples.x.transpose() * samples.x).array();
  s.factor_ = s.smooth_.array() + s.nuisance_.array() + kernel.linear * dots + kernel.quadratic * dots.square();
  s.variances_.warm_up = samples.warm_up;
  compensation::add_warm_up(s.variances_, samples.time_h, s.factor_);
  s.factor_.diagonal().array() += s.variances_.noise / weight.array() + compensation::kCompositeJitter;
  if (!s.factor_.allFinite() || !cholesky(s.factor_)) return std::nullopt;
  s.nu_ = Eigen::VectorXd::Ones(samples.y.size());
  solve_cholesky(s.factor_, s.nu_);
  s.ones_ = s.nu_.sum();
  if (!(s.ones_ > 0)) return std::nullopt;
  s.beta_ = s.nu_.dot(samples.y) / s.ones_;
  s.alpha_ = samples.y.array() - s.beta_;
  solve_cholesky(s.factor_, s.alpha_);
  return s;
}

Eigen::VectorXd CompositeSystem::residual() const { return variances_.noise * alpha_.cwiseQuotient(weight_); }

double CompositeSystem::objective(Eigen::VectorXd* gradient_out, const DriftPrior& drift) const {
  const Eigen::Index nuisance = 3 + samples_->x.rows();
  const double from_centre = theta_[nuisance] - drift.centre;
  if (gradient_out) {
    *gradient_out = gradient();
    (*gradient_out)[nuisance] += drift.weight * from_centre;
  }
  return factor_.diagonal().array().log().sum() + 0.5 * std::log(ones_) + 0.5 * samples_->y.dot(alpha_) +
         kPrior * theta_.squaredNorm() + drift.weight * from_centre * from_centre / 2;
}

// With W = H⁻¹ − nu nuᵀ/1ᵀnu − alpha alphaᵀ: ∂/∂theta_j = ½ Σ W ∘ ∂H/∂theta_j; the lower triangle, doubled off the
// diagonal.
Eigen::VectorXd CompositeSystem::gradient() const {
  const Eigen::MatrixXd& x = samples_->x;
  const Eigen::Index n = x.cols(), d = x.rows();
  const Eigen::MatrixXd half = inverse_lower(factor_).transpose();
  Eigen::MatrixXd w = Eigen::MatrixXd::Zero(n, n);
  add_gram(half, w);
  const compensation::CompositeKernel& kernel = variances_.kernel;
  Eigen::VectorXd g = Eigen::VectorXd::Zero(theta_.size());
  for (Eigen::Index j = 0; j < n; ++j) {
    const Eigen::Index m = n - j;
    Eigen::ArrayXd column = w.col(j).tail(m) - (nu_[j] / ones_) * nu_.tail(m) - alpha_[j] * alpha_.tail(m);
    column[0] *= 0.5;  // the lower triangle is doubled, but the diagonal counts once
    g[5 + d] += column[0] * variances_.noise / weight_[j];
    const Eigen::ArrayXd smooth = column * smooth_.col(j).tail(m).array();
    g[0] += smooth.sum();
    Eigen::ArrayXd dots = Eigen::ArrayXd::Zero(m);
    for (Eigen::Index i = 0; i < d; ++i) {
      const Eigen::ArrayXd row = x.row(i).tail(m).transpose();
      g[1 + i] += (smooth * (row - x(i, j)).square()).sum() / (2 * kernel.length2[i]);
      dots += row * x(i, j);
    }
    g[1 + d] += kernel.linear * (column * dots).sum();
    g[2 + d] += kernel.quadratic * (column * dots.square()).sum();
    Eigen::Index same = 0;  // the first samples of the column are of the same recording
    const int recording = samples_->recording[static_cast<std::size_t>(j)];
    while (same < m && samples_->recording[static_cast<std::size_t>(j + same)] == recording) ++same;
    const auto inside = column.head(same);
    const Eigen::ArrayXd q = inside * (nuisance_.col(j).segment(j, same).array() - variances_.offset);
    const Eigen::ArrayXd apart = (samples_->time_h.segment(j, same).array() - samples_->time_h[j]).abs();
    g[3 + d] += q.sum();
    g[4 + d] += (q * apart).sum() / variances_.nuisance_time_h;
    if (g.size() > 6 + d) g[6 + d] += variances_.offset * inside.sum();
  }
  return g + 2 * kPrior * theta_;
}

Eigen::VectorXd CompositeSystem::predict(const Eigen::MatrixXd& x, Eigen::VectorXd* variance) const {
  compensation::CompositeCentres centres(variances_.kernel, samples_->x);
  centres.weigh(alpha_);
  Eigen::VectorXd mean(x.cols());
  if (variance) variance->resize(x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    mean[i] = centres.sum(x.col(i)) + beta_;
    if (!variance) continue;
    Eigen::VectorXd k = centres.row(x.col(i));
    const double level = 1 - nu_.dot(k);
    solve_lower(factor_, k);
    (*variance)[i] = std::max(0.0, variances_.kernel.variance(x.col(i)) - k.squaredNorm() + level * level / ones_);
  }
  return mean;
}

}  // namespace prism::training
