// SPDX-License-Identifier: MIT
#include "compensation/training/tuning_cost.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "compensation/kernel.hpp"
#include "compensation/training/dense.hpp"

namespace prism::training {
namespace {

constexpr double kSearchAccuracy = 1e-2, kFinalAccuracy = 1e-6;  // limit of c · the part of K outside the low rank
// In scales: largest change of a residual between the last two solves of a final cost.
constexpr double kFinalChange = 1e-6;
constexpr Eigen::Index kDenseSamples = 3000;  // with more samples the full matrix is never faster
constexpr Eigen::Index kRefitRank = 160;      // above it the search uses fixed weights in the folds
constexpr int kDenseSolves = 8;
// Up to this number of samples the search uses the final cost, with each fold started unweighted: few samples have many
// fixed points with Hampel's and myriad's weights, and the fold's own may not be that of the complete data.
constexpr Eigen::Index kFreshSamples = 200;

// Re-weights the samples `inside`. Samples outside keep their weights and do not affect the scale, but all residuals
// must converge within `tolerance` scales. `weight`: first weights in, last weights out.
bool reweight_inside(PrimalLssvm& primal, const ReweightSettings& settings, double tolerance,
                     const std::vector<Eigen::Index>& inside, Eigen::VectorXd& weight) {
  Eigen::VectorXd residual, before;
  const auto solve = [&](const Eigen::VectorXd& v) -> Result<Eigen::VectorXd> {
    weight(inside) = v;
    if (!primal.solve(weight)) return make_error("tuning", "the system is not positive definite");
    before = std::move(residual);
    residual = primal.residuals();
    return residual(inside);
  };
  const auto rule = [&](const ReweightStep&, ReweightReport& report) {
    return residuals_within(tolerance)({weight, weight, before, residual}, report);
  };
  Eigen::VectorXd first = weight(inside);
  return reweight(settings, first, solve, rule).has_value();
}

// Leave-one-out tunes without weights: those of a closely following model favour the rows that agree with it, so that
// its cost falls below the noise. Gross outliers are already left out, and the cost is a mean of absolute errors.
bool weighs(const TuningCost& cost) { return cost.robust() && cost.kind() != Tuning::kLoo; }

Eigen::VectorXd nothing(Eigen::Index n) { return Eigen::VectorXd::Constant(n, kNever); }

}  // namespace

Tuning tuning_by_name(std::string_view name) {
  return name == "shuffled" ? Tuning::kShuffled
         : name == "loo"    ? Tuning::kLoo
         : name == "reml"   ? Tuning::kReml
                            : Tuning::kBlocked;
}

TuningCost::TuningCost(const Eigen::MatrixXd& points, const Eigen::VectorXd& y, double scale, Tuning kind, Folds folds,
                       ReweightSettings settings)
    : points_(points),
      y_(y),
      scale_(scale),
      kind_(kind),
      folds_(std::move(folds)),
      members_(fold_members(folds_)),
      settings_(settings) {}

double TuningCost::evaluate(const TuningPoint& point) const {
  if (y_.size() <= kFreshSamples) return final_cost(point);
  return cost_of(system_for(point.sigma2, kSearchAccuracy / point.c, false), point, kSearchAccuracy, false, false);
}

double TuningCost::frozen_cost(const TuningPoint& point) const {
  return cost_of(system_for(point.sigma2, kSearchAccuracy / point.c, false), point, kSearchAccuracy, true, false);
}

void TuningCost::frozen_costs(std::span<TuningPoint> row) const {
  double c_max = 0;
  for (const TuningPoint& point : row) c_max = std::max(c_max, point.c);
  const LowRank finest = system_for(row.front().sigma2, kSearchAccuracy / c_max, false);
  for (TuningPoint& point : row) {
    assert(point.sigma2 == row.front().sigma2);
    point.cost = cost_of(coarser(finest, kSearchAccuracy / point.c), point, kSearchAccuracy, true, false);
  }
}

bool TuningCost::refits(const TuningPoint& point) const {
  return y_.size() <= kFreshSamples || system_for(point.sigma2, kSearchAccuracy / point.c, false).rank() <= kRefitRank;
}

double TuningCost::final_cost(const TuningPoint& point) const {
  return cost_of(system_for(point.sigma2, kFinalAccuracy / point.c, true), point, kFinalAccuracy, false, true);
}

ReweightSettings TuningCost::settings_at(const TuningPoint& point, int limit) const {
  ReweightSettings settings = settings_;
  settings.weight.parameter = point.parameter;
  settings.limit = std::min(settings.limit, limit);
  return settings;
}

bool TuningCost::dense_pays(bool exact) const { return !exact && y_.size() <= kDenseSamples; }

LowRank TuningCost::system_for(double sigma2, double tolerance, bool exact) const {
  return low_rank(points_, sigma2, tolerance, dense_pays(exact) ? y_.size() / 2 : y_.size());
}

double TuningCost::cost_of(const LowRank& system, const TuningPoint& point, double accuracy, bool frozen,
                           bool exact) const {
  const bool dense = dense_pays(exact) && system.left > accuracy / point.c && system.rank() == y_.size() / 2;
  if (kind_ == Tuning::kReml) return dense ? reml(point) : reml(system, point.c);
  const bool costly = system.rank() > kRefitRank;
  const Eigen::VectorXd residual =
      dense ? held_out(point) : held_out(system, point, frozen || (costly && !exact), exact);
  const double cost = kind_ == Tuning::kLoo ? residual.cwiseAbs().mean() : mean_of_folds(residual);
  return std::isfinite(cost) ? cost * scale_ : kNever;
}

// For ranks of half of the samples or more: the full matrix, with fixed weights in the folds.
Eigen::VectorXd TuningCost::held_out(const TuningPoint& point) const {
  const Eigen::MatrixXd kernel = compensation::kernel_matrix(points_, {point.sigma2});
  ReweightSettings settings = settings_at(point, kDenseSolves);
  if (!weighs(*this)) settings.weight.kind = WeightKind::kNone;
  settings.tolerance = 1e-3 * point.c;
  settings.weight.hampel_floor = std::max(settings.weight.hampel_floor, 1e-7);
  const auto fit = fit_irlssvm(kernel, y_, point.c, settings);
  if (!fit) return nothing(y_.size());
  return kind_ == Tuning::kLoo ? fit->factor.leave_one_out() : fit->factor.leave_fold_out(folds_);
}

double TuningCost::reml(const TuningPoint& point) const {
  const auto factor = LssvmFactor::make(compensation::kernel_matrix(points_, {point.sigma2}),
                                        Eigen::VectorXd::Constant(y_.size(), 1 / point.c), y_);
  return factor ? -factor->restricted_log_likelihood() / static_cast<double>(y_.size()) : kNever;
}

double TuningCost::mean_of_folds(const Eigen::VectorXd& residual) const {
  double total = 0;
  for (const auto& fold : members_) total += residual(fold).cwiseAbs().mean();
  return total / static_cast<double>(members_.size());
}

Eigen::VectorXd TuningCost::held_out(const LowRank& system, const TuningPoint& point, bool frozen, bool exact) const {
  const Eigen::Index n = y_.size();
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(n);
  PrimalLssvm primal(system, y_, point.c);
  if (weighs(*this)) {
    const double tolerance = exact ? kFinalChange : frozen ? 1e-3 : 1e-4;
    const bool refit = !frozen;
    if (refit && exact) return refitted_folds(system, point, weight, exact);
    // A high rank uses the cost of the full matrix: the search only has to find that it is not better there.
    const int limit = !exact && system.rank() > kRefitRank ? kDenseSolves : kRobustSolves;
    if (!reweight_inside(primal, settings_at(point, limit), tolerance, others({}, n), weight)) return nothing(n);
    if (refit) return refitted_folds(system, point, weight, exact);
  } else if (!primal.solve(weight)) {
    return nothing(n);
  }
  if (kind_ != Tuning::kLoo) return frozen_folds(system, point.c, weight);
  // Leave-one-out: ξ / (1 − v h).
  return primal.residuals().array() / (1 - weight.array() * primal.leverages().array()).max(1e-12);
}

// The matrix of the other samples is that of all samples minus that of the fold: one downdate and one small factor per
// fold.
Eigen::VectorXd TuningCost::frozen_folds(const LowRank& system, double c, const Eigen::VectorXd& weight) const {
  PrimalLssvm primal(system, y_, c);
  const Eigen::MatrixXd all = primal.gram(weight);
  const Eigen::VectorXd moment = system.phi * weight.cwiseProduct(y_);
  Eigen::VectorXd residual(y_.size());
  for (const auto& fold : members_) {
    const Eigen::MatrixXd phi = system.phi(Eigen::all, fold);
    const Eigen::VectorXd v = weight(fold);
    Eigen::MatrixXd gram = all;
    add_gram(phi, gram, &v, -1);
    if (!primal.solve(gram, moment - phi * v.cwiseProduct(y_(fold)))) return nothing(y_.size());
    residual(fold) = y_(fold) - phi.transpose() * primal.theta();
  }
  return residual;
}

Eigen::VectorXd TuningCost::refitted_folds(const LowRank& system, const TuningPoint& point,
                                           const Eigen::VectorXd& start, bool exact) const {
  const ReweightSettings settings = settings_at(point, kRobustSolves);
  const bool once = settings_.limit == 1;
  Eigen::VectorXd residual(y_.size());
  for (const auto& fold : members_) {
    const std::vector<Eigen::Index> inside = others(fold, y_.size());
    Eigen::VectorXd weight = once ? Eigen::VectorXd::Ones(y_.size()) : start;
    weight(fold).setZero();
    PrimalLssvm primal(system, y_, point.c);
    if (!reweight_inside(primal, settings, exact ? kFinalChange : 1e-4, inside, weight)) return nothing(y_.size());
    residual(fold) = y_(fold) - system.phi(Eigen::all, fold).transpose() * primal.theta();
  }
  return residual;
}

// −restricted log-likelihood per sample. In the primal log|H| + log(1ᵀ H⁻¹ 1) = (r + 1 − N) log c + log|diag(I/c, 0) +
// Φ Φᵀ| and s_f² = c yᵀ ξ / (N − 1).
double TuningCost::reml(const LowRank& system, double c) const {
  PrimalLssvm primal(system, y_, c);
  if (!primal.solve(Eigen::VectorXd::Ones(y_.size()))) return kNever;
  const double n = static_cast<double>(y_.size()), r = static_cast<double>(system.rank());
  const double prior = c * y_.dot(primal.residuals()) / (n - 1);
  if (!(prior > 0)) return kNever;
  const double determinants = (r + 1 - n) * std::log(c) + primal.log_determinant();
  return 0.5 * ((n - 1) * (std::log(2 * std::numbers::pi * prior) + 1) + determinants) / n;
}

}  // namespace prism::training
