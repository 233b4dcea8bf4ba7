// SPDX-License-Identifier: MIT
#include "compensation/training/composite.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "compensation/training/dense.hpp"
#include "compensation/training/low_rank.hpp"
#include "compensation/training/minimise.hpp"

namespace prism::training {

constexpr double kPrior = 0.005;  // factor of |theta|²

CompositeSamples CompositeSamples::part(const Rows& rows) const {
  return {x(Eigen::all, rows), y(rows), time_h(rows), taken(recording, rows), recordings, warm_up};
}

Eigen::VectorXd composite_theta(const compensation::CompositeVariances& v, bool offsets) {
  const Eigen::Index d = v.kernel.length2.size();
  Eigen::VectorXd value(d + 7);
  value << v.kernel.rbf, v.kernel.length2, v.kernel.linear, v.kernel.quadratic, v.nuisance, v.nuisance_time_h, v.noise,
      v.offset;
  return value.head(d + (offsets ? 7 : 6)).array().log();
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

NuisanceFilter::NuisanceFilter(const compensation::CompositeVariances& v, const Eigen::VectorXd& time_h,
                               const std::vector<int>& recording, const Eigen::VectorXd& weight)
    : steps_(recording.size()) {
  Eigen::Matrix2d p = Eigen::Matrix2d::Zero();
  for (std::size_t k = 0; k < steps_.size(); ++k) {
    Step& step = steps_[k];
    const auto i = static_cast<Eigen::Index>(k);
    step.fresh = k == 0 || recording[k] != recording[k - 1];
    if (step.fresh) {
      p << v.nuisance, 0, 0, v.offset;
    } else {
      step.kept = std::exp(-std::abs(time_h[i] - time_h[i - 1]) / v.nuisance_time_h);
      p(0, 0) = step.kept * step.kept * p(0, 0) + v.nuisance * (1 - step.kept * step.kept);
      p(0, 1) = p(1, 0) = step.kept * p(0, 1);
    }
    const Eigen::Vector2d seen = p.rowwise().sum();
    step.variance = seen.sum() + v.noise / weight[i] + compensation::kCompositeJitter;
    step.gain_nuisance = seen[0] / step.variance;
    step.gain_offset = seen[1] / step.variance;
    p -= seen * seen.transpose() / step.variance;
  }
}

void NuisanceFilter::whiten(Eigen::MatrixXd& values, Eigen::Index first, Carry& carry) const {
  for (Eigen::Index j = 0; j < values.cols(); ++j) {
    const Step& step = steps_[static_cast<std::size_t>(first + j)];
    auto column = values.col(j);
    carry.nuisance *= step.kept;
    if (step.fresh) carry.offset.setZero();
    column -= carry.nuisance + carry.offset;
    carry.nuisance += step.gain_nuisance * column;
    carry.offset += step.gain_offset * column;
    column /= std::sqrt(step.variance);
  }
}

Eigen::VectorXd NuisanceFilter::solve(const Eigen::VectorXd& y) const {
  Eigen::VectorXd result(y.size());
  double nuisance = 0, offset = 0;
  for (std::size_t k = 0; k < steps_.size(); ++k) {
    const Step& step = steps_[k];
    nuisance *= step.kept;
    if (step.fresh) offset = 0;
    const double innovation = y[static_cast<Eigen::Index>(k)] - nuisance - offset;
    nuisance += step.gain_nuisance * innovation;
    offset += step.gain_offset * innovation;
    result[static_cast<Eigen::Index>(k)] = innovation / step.variance;
  }
  // Backwards: u_k = e_k/F_k − gainᵀ Tᵀ r_k, r_{k−1} = 1 u_k + Tᵀ r_k, T = diag(kept, 1) to the next sample.
  double r_nuisance = 0, r_offset = 0;
  for (std::size_t k = steps_.size(); k-- > 0;) {
    const bool last = k + 1 == steps_.size() || steps_[k + 1].fresh;
    r_nuisance = last ? 0 : steps_[k + 1].kept * r_nuisance;
    r_offset = last ? 0 : r_offset;
    double& u = result[static_cast<Eigen::Index>(k)];
    u -= steps_[k].gain_nuisance * r_nuisance + steps_[k].gain_offset * r_offset;
    r_nuisance += u;
    r_offset += u;
  }
  return result;
}

namespace {

constexpr Eigen::Index kCoarseSamples = 320, kMiddleSamples = 500, kFineSamples = 1000;
constexpr int kCoarseEvaluations = 60, kFineEvaluations = 40;
constexpr double kImpossible = std::numeric_limits<double>::infinity();

// Starts of the search: [s1², l², s2², s3², s4², tau, s_n²] (offsets: s5²). A smooth bias with white noise; a
// polynomial; a wiggly one; mostly drift.
std::vector<Eigen::VectorXd> starts(Eigen::Index inputs, bool offsets) {
  constexpr double kStarts[][7] = {{-1, 0.7, -1, -2, -2, 0.7, -2},
                                   {-3, 2, -0.5, -1, -3, 2, -1.5},
                                   {-1, -1, -2, -4, -4, 1, -2},
                                   {-2, 1, -1, -3, -1, 1.5, -3}};
  std::vector<Eigen::VectorXd> all;
  for (const auto& s : kStarts) {
    Eigen::VectorXd theta = Eigen::VectorXd::Constant(inputs + (offsets ? 7 : 6), -3);
    theta.head(inputs + 6) << s[0], Eigen::VectorXd::Constant(inputs, s[1]), s[2], s[3], s[4], s[5], s[6];
    all.push_back(theta);
  }
  return all;
}

/// Minimises the objective over `part` from `start`.
using Descent = std::function<Minimum(const CompositeSamples& part, const Eigen::VectorXd& weight,
                                      const Eigen::VectorXd& start, int most, const Eigen::MatrixXd& inverse_hessian)>;

/// `tell`: called with each value.
Descent descent(const DriftPrior& drift, const TuningSettings& tuning, std::function<void(double)> tell) {
  return [=, &tuning](const CompositeSamples& part, const Eigen::VectorXd& weight, const Eigen::VectorXd& start,
                      int most, const Eigen::MatrixXd& inverse_hessian) {
    const auto f = [&](const Eigen::VectorXd& theta, Eigen::VectorXd& gradient) {
      constexpr double kFarthest = 25;  // e^±25: no data can distinguish such a parameter from 0 or infinity
      if (!(theta.cwiseAbs().maxCoeff() < kFarthest)) return kImpossible;
      const auto system = CompositeSystem::make(part, theta, weight);
      const double value = system ? system->objective(&gradient, drift) : kImpossible;
      if (tell) tell(value);
      return value;
    };
    return minimise_smooth(f, start, most, inverse_hessian, [&] { return tuning.stopped(); });
  };
}

}  // namespace

double believed_sd(const Eigen::VectorXd& y, const Eigen::VectorXd& weight) {
  const Eigen::ArrayXd believed = (weight.array() >= kBelievedWeight).cast<double>();
  const double mean = (believed * y.array()).sum() / believed.sum();
  return std::sqrt((believed * (y.array() - mean).square()).sum() / believed.sum());
}

namespace {

// The last system and its report. `weight`: first weights in, last weights out.
std::optional<CompositeSystem> reweighted_system(const CompositeSamples& samples, const Eigen::VectorXd& theta,
                                                 ReweightSettings settings, Eigen::VectorXd& weight,
                                                 ReweightReport& report) {
  settings.min_weight = kMinCompositeWeight;
  std::optional<CompositeSystem> system;
  const auto solve = [&](const Eigen::VectorXd& v) -> Result<Eigen::VectorXd> {
    system = CompositeSystem::make(samples, theta, v);
    if (!system) return make_error("composite kernel", "the covariance of the samples is not positive definite");
    return system->residual();
  };
  const auto done = reweight(settings, weight, solve, weights_settled());
  if (!done) return std::nullopt;
  report = *done;
  return system;
}

// Re-weights at `from`, then descends. `scale`: from the samples of its inverse Hessian to those of `part`.
std::optional<Minimum> refined(const Descent& descend, const CompositeSamples& part, const ReweightSettings& settings,
                               Eigen::VectorXd weight, const Minimum& from, double scale) {
  ReweightReport report;
  if (!reweighted_system(part, from.x, settings, weight, report)) return std::nullopt;
  return descend(part, weight, from.x, kFineEvaluations, from.inverse_hessian * scale);
}

// The best of the optima that the starts find, unless another one is clearly better with robust weights: without them
// outliers decide. Weights differ between optima, so that small differences do not count.
std::optional<Minimum> best_weighted(const Descent& descend, const CompositeSamples& coarse,
                                     const ReweightSettings& settings, const Eigen::VectorXd& first) {
  constexpr double kClear = 5;  // of the log likelihood
  std::vector<Minimum> optima;
  for (const Eigen::VectorXd& start : starts(coarse.x.rows(), coarse.recordings > 1)) {
    auto found = descend(coarse, first, start, kCoarseEvaluations, {});
    if (std::isfinite(found.value)) optima.push_back(std::move(found));
  }
  std::stable_sort(optima.begin(), optima.end(), [](const auto& a, const auto& b) { return a.value < b.value; });
  const auto same = [](const auto& a, const auto& b) { return b.value - a.value < 0.02; };
  optima.erase(std::unique(optima.begin(), optima.end(), same), optima.end());
  std::optional<Minimum> best;
  double limit = std::numeric_limits<double>::infinity();
  for (const Minimum& optimum : optima) {
    auto found = refined(descend, coarse, settings, first, optimum, 1);
    if (!found || !(found->value < limit)) continue;
    limit = best ? found->value : found->value - kClear;
    best = std::move(found);
  }
  return best;
}

}  // namespace

Result<CompositeFit> search_composite(const CompositeSamples& samples, const ReweightSettings& settings,
                                      const DriftPrior& drift, const TuningSettings& tuning,
                                      const Eigen::VectorXd& first) {
  constexpr int kExpected = 4 * 45 + 3 * 20;  // evaluations
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(samples.y.size());
  // Outliers enlarge the variance of the target, of which the drift is expected to be a share.
  DriftPrior expected = drift;
  expected.centre += 2 * std::log(believed_sd(samples.y, first) / believed_sd(samples.y, ones));
  int evaluations = 0;
  double least = kImpossible;
  const Descent descend = descent(expected, tuning, [&](double value) {
    least = std::min(least, value);
    if (tuning.progress) tuning.progress(++evaluations, kExpected, {0, 0, 0, least});
  });
  std::optional<Minimum> best;
  double searched = 0;
  for (const Eigen::Index most : {kCoarseSamples, kMiddleSamples, kFineSamples}) {
    if (static_cast<Eigen::Index>(searched) == samples.y.size()) break;
    const Rows rows = thinned(samples.y.size(), most);
    const CompositeSamples part = samples.part(rows);
    const double now = static_cast<double>(part.y.size());
    best = best ? refined(descend, part, settings, first(rows), *best, searched / now)
                : best_weighted(descend, part, settings, first(rows));
    if (!best) return make_error("composite kernel", "the search found no finite likelihood");
    searched = now;
  }
  return CompositeFit{best->x, first, best->value};
}

CompositeFit likely_theta(const CompositeSamples& samples, const DriftPrior& drift, const TuningSettings& tuning) {
  CompositeFit best{{}, Eigen::VectorXd::Ones(samples.y.size()), kImpossible};
  const Descent descend = descent(drift, tuning, {});
  for (const Eigen::VectorXd& start : starts(samples.x.rows(), samples.recordings > 1)) {
    const Minimum found = descend(samples, best.weight, start, kCoarseEvaluations, {});
    if (found.value < best.objective) best.theta = found.x, best.objective = found.value;
  }
  return best;
}

std::optional<CompositeSolution> solve_composite(const CompositeSamples& samples, const Eigen::VectorXd& theta,
                                                 const Eigen::VectorXd& weight, const ReweightSettings& settings) {
  CompositeSolution s;
  s.centres = others({}, samples.y.size());
  s.weight = weight;
  const auto system = reweighted_system(samples, theta, settings, s.weight, s.reweight);
  if (!system) return std::nullopt;
  compensation::CompositeParameters& p = s.parameters;
  p.variances = composite_variances(theta, samples.x.rows());
  p.variances.warm_up = samples.warm_up;
  p.beta = system->beta();
  p.centres = samples.x;
  p.alpha = system->alpha();
  p.weight = s.weight;
  p.time_h = samples.time_h;
  p.recording = samples.recording;
  s.fitted = system->predict(samples.x);
  return s;
}

namespace {

// The filter of the nuisance over all rows of Ψ and y: [Ψ; yᵀ] Λ⁻¹ [Ψ; yᵀ]ᵀ, lower triangle.
Eigen::MatrixXd moments_of(const NuisanceFilter& filter, const Eigen::MatrixXd& psi, const Eigen::VectorXd& y) {
  constexpr Eigen::Index kPiece = 1024;
  const Eigen::Index rows = psi.rows() + 1;
  NuisanceFilter::Carry carry(rows);
  Eigen::MatrixXd moments = Eigen::MatrixXd::Zero(rows, rows);
  for (Eigen::Index first = 0; first < y.size(); first += kPiece) {
    const Eigen::Index count = std::min(kPiece, y.size() - first);
    Eigen::MatrixXd piece(rows, count);
    piece << psi.middleCols(first, count), y.segment(first, count).transpose();
    filter.whiten(piece, first, carry);
    add_gram(piece, moments);
  }
  return moments;
}

}  // namespace

LowRank composite_pivots(const compensation::CompositeKernel& kernel, const Eigen::MatrixXd& points, double tolerance,
                         Eigen::Index max_rank) {
  const compensation::CompositeCentres centres(kernel, points);
  Eigen::VectorXd variance(points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) variance[i] = kernel.variance(points.col(i));
  const auto row = [&](Eigen::Index i, Eigen::VectorXd& k) { k = centres.row(points.col(i)); };
  return pivoted_cholesky(variance, row, tolerance, max_rank);
}

std::optional<CompositeSolution> solve_sparse_composite(const CompositeSamples& samples, const Eigen::VectorXd& theta,
                                                        ReweightSettings settings, Eigen::Index max_rank) {
  constexpr Eigen::Index kPivotSamples = 4000;
  constexpr double kLeftOfNoise = 1e-3;  // maximum kernel variance outside the centres, in noise variances
  constexpr int kSparseSolves = 30;
  CompositeSolution s;
  s.weight = Eigen::VectorXd::Ones(samples.y.size());
  compensation::CompositeParameters& p = s.parameters;
  p.variances = composite_variances(theta, samples.x.rows());
  const compensation::CompositeVariances& v = p.variances;
  const Rows tried = thinned(samples.y.size(), kPivotSamples);
  const LowRank found = composite_pivots(v.kernel, samples.x(Eigen::all, tried), kLeftOfNoise * v.noise, max_rank);
  for (const Eigen::Index i : found.pivots) s.centres.push_back(tried[static_cast<std::size_t>(i)]);
  const Eigen::Index r = found.rank();
  p.centres = samples.x(Eigen::all, s.centres);
  Eigen::MatrixXd factor = v.kernel.matrix(p.centres);
  factor.diagonal().array() += compensation::kCompositeJitter * v.kernel.rbf;
  if (!cholesky(factor)) return std::nullopt;
  const compensation::CompositeCentres centres(v.kernel, p.centres);
  Eigen::MatrixXd psi(r + 1, samples.y.size());
  for (Eigen::Index i = 0; i < psi.cols(); ++i) {
    Eigen::VectorXd k = centres.row(samples.x.col(i));
    solve_lower(factor, k);
    psi.col(i) << k, 1.0;
  }
  Eigen::VectorXd w, residual;
  settings.min_weight = kMinCompositeWeight;
  settings.limit = std::min(settings.limit, kSparseSolves);
  const auto solve = [&](const Eigen::VectorXd& weight) -> Result<Eigen::VectorXd> {
    const NuisanceFilter filter(v, samples.time_h, samples.recording, weight);
    const Eigen::MatrixXd moments = moments_of(filter, psi, samples.y);
    p.gram = moments.topLeftCorner(r + 1, r + 1);
    p.gram.diagonal().head(r).array() += 1;
    w = moments.row(r + 1).head(r + 1).transpose();
    Eigen::MatrixXd inverse = p.gram;
    const bool good = cholesky(inverse);
    if (good) solve_cholesky(inverse, w);
    if (!good || !w.allFinite())
      return make_error("composite kernel", "the covariance of the centres is not positive definite");
    residual = samples.y - psi.transpose() * w;
    return Eigen::VectorXd(v.noise * filter.solve(residual).cwiseQuotient(weight));
  };
  const auto report = reweight(settings, s.weight, solve, weights_settled());
  if (!report) return std::nullopt;
  s.reweight = *report;
  s.fitted = samples.y - residual;
  p.alpha = w.head(r);  // w · φ(x) = (L⁻ᵀ w) · k(x)
  solve_lower_transposed(factor, p.alpha);
  p.beta = w[r];
  p.gram = Eigen::MatrixXd(p.gram.selfadjointView<Eigen::Lower>());
  return s;
}

}  // namespace prism::training
