// SPDX-License-Identifier: MIT
#include "compensation/training/tuning.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <mutex>
#include <numbers>

#include "compensation/kernel.hpp"
#include "compensation/training/dense.hpp"
#include "compensation/training/lssvm.hpp"
#include "compensation/training/minimise.hpp"

namespace prism::training {
namespace {

constexpr std::array kWords = {"blocked", "shuffled", "given", "loo", "reml"};
constexpr std::array kTexts = {"blocked folds", "shuffled folds", "given folds", "leave-one-out", "reml"};

constexpr double kSearchAccuracy = 1e-2, kFinalAccuracy = 1e-6;  // limit of c · the part of K outside the low rank
// In scales: largest change of a residual between the last two solves of a cost, by effort.
constexpr std::array kResidualChange = {1e-3, 1e-4, 1e-6};
constexpr Eigen::Index kDenseSamples = 3000;  // with more samples the full matrix is never faster
constexpr Eigen::Index kRefitRank = 160;      // above it the search uses fixed weights in the folds
constexpr int kDenseSolves = 8;
// Up to this number of samples the search uses the final cost, with each fold started unweighted: few samples have many
// fixed points with Hampel's and myriad's weights, and the fold's own may not be that of the complete data.
constexpr Eigen::Index kFreshSamples = 200;

bool dense_pays(const TuningCost& cost, Effort effort) {
  return effort != Effort::kFinal && cost.y.size() <= kDenseSamples;
}

double accuracy_of(Effort effort) { return effort == Effort::kFinal ? kFinalAccuracy : kSearchAccuracy; }

LowRank system_for(const TuningCost& cost, double sigma2, double c, Effort effort) {
  const Eigen::Index n = cost.y.size();
  return low_rank(cost.points, sigma2, accuracy_of(effort) / c, dense_pays(cost, effort) ? n / 2 : n);
}

ReweightSettings settings_at(const TuningCost& cost, const TuningPoint& point, int limit) {
  ReweightSettings settings = cost.settings;
  settings.weight.parameter = point.parameter;
  settings.limit = std::min(settings.limit, limit);
  return settings;
}

// Re-weights the samples `inside`. Samples outside keep their weights and do not affect the scale, but all residuals
// must converge within `tolerance` scales. `weight`: first weights in, last weights out.
bool reweight_inside(PrimalLssvm& primal, const ReweightSettings& settings, Effort effort, const Rows& inside,
                     Eigen::VectorXd& weight) {
  Eigen::VectorXd residual, before;
  const auto solve = [&](const Eigen::VectorXd& v) -> Result<Eigen::VectorXd> {
    weight(inside) = v;
    if (!primal.solve(weight)) return make_error("tuning", "the system is not positive definite");
    before = std::move(residual);
    residual = primal.residuals();
    return residual(inside);
  };
  const auto rule = [&](const ReweightStep&, ReweightReport& report) {
    const double tolerance = kResidualChange[static_cast<std::size_t>(effort)];
    return residuals_within(tolerance)({weight, weight, before, residual}, report);
  };
  Eigen::VectorXd first = weight(inside);
  return reweight(settings, first, solve, rule).has_value();
}

// For ranks of half of the samples or more: the full matrix, with fixed weights in the folds. Empty if no fit is
// possible, as all held-out residuals below.
Eigen::VectorXd dense_residual(const TuningCost& cost, const TuningPoint& point) {
  const Eigen::MatrixXd kernel = compensation::kernel_matrix(cost.points, point.sigma2);
  ReweightSettings settings = settings_at(cost, point, kDenseSolves);
  if (!cost.weighs()) settings.weight.kind = WeightKind::kNone;
  settings.tolerance = 1e-3 * point.c;
  settings.weight.hampel_floor = std::max(settings.weight.hampel_floor, 1e-7);
  const auto fit = fit_irlssvm(kernel, cost.y, point.c, settings);
  if (!fit) return {};
  return cost.kind == Tuning::kLoo ? fit->factor.leave_one_out() : fit->factor.leave_fold_out(cost.folds);
}

double dense_reml(const TuningCost& cost, const TuningPoint& point) {
  const Eigen::VectorXd noise = Eigen::VectorXd::Constant(cost.y.size(), 1 / point.c);
  const auto factor = LssvmFactor::make(compensation::kernel_matrix(cost.points, point.sigma2), noise, cost.y);
  return factor ? -factor->restricted_log_likelihood() / static_cast<double>(cost.y.size()) : kNever;
}

// −restricted log-likelihood per sample. In the primal log|H| + log(1ᵀ H⁻¹ 1) = (r + 1 − N) log c + log|diag(I/c, 0) +
// Φ Φᵀ| and s_f² = c yᵀ ξ / (N − 1).
double reml(const LowRank& system, const Eigen::VectorXd& y, double c) {
  PrimalLssvm primal(system, y, c);
  if (!primal.solve(Eigen::VectorXd::Ones(y.size()))) return kNever;
  const double n = static_cast<double>(y.size()), r = static_cast<double>(system.rank());
  const double prior = c * y.dot(primal.residuals()) / (n - 1);
  if (!(prior > 0)) return kNever;
  const double determinants = (r + 1 - n) * std::log(c) + primal.log_determinant();
  return 0.5 * ((n - 1) * (std::log(2 * std::numbers::pi * prior) + 1) + determinants) / n;
}

// The matrix of the other samples is that of all samples minus that of the fold: one downdate and one small factor per
// fold.
Eigen::VectorXd frozen_folds(const TuningCost& cost, const LowRank& system, double c, const Eigen::VectorXd& weight) {
  PrimalLssvm primal(system, cost.y, c);
  const Eigen::MatrixXd all = primal.gram(weight);
  const Eigen::VectorXd moment = system.phi * weight.cwiseProduct(cost.y);
  return held_out(cost.folds, [&](const Rows&, const Rows& fold) -> Eigen::VectorXd {
    const Eigen::MatrixXd phi = system.phi(Eigen::all, fold);
    const Eigen::VectorXd v = weight(fold);
    Eigen::MatrixXd gram = all;
    add_gram(phi, gram, &v, -1);
    if (!primal.solve(gram, moment - phi * v.cwiseProduct(cost.y(fold)))) return {};
    return cost.y(fold) - phi.transpose() * primal.theta();
  });
}

Eigen::VectorXd refitted_folds(const TuningCost& cost, const LowRank& system, const TuningPoint& point,
                               const Eigen::VectorXd& start, Effort effort) {
  const ReweightSettings settings = settings_at(cost, point, kRobustSolves);
  return held_out(cost.folds, [&](const Rows& inside, const Rows& fold) -> Eigen::VectorXd {
    Eigen::VectorXd weight = cost.settings.limit == 1 ? Eigen::VectorXd::Ones(start.size()) : start;
    weight(fold).setZero();
    PrimalLssvm primal(system, cost.y, point.c);
    if (!reweight_inside(primal, settings, effort, inside, weight)) return {};
    return cost.y(fold) - system.phi(Eigen::all, fold).transpose() * primal.theta();
  });
}

Eigen::VectorXd low_rank_residual(const TuningCost& cost, const LowRank& system, const TuningPoint& point,
                                  Effort effort) {
  const bool costly = system.rank() > kRefitRank && effort != Effort::kFinal;
  if (costly) effort = Effort::kFrozen;
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(cost.y.size());
  PrimalLssvm primal(system, cost.y, point.c);
  if (cost.weighs()) {
    if (effort == Effort::kFinal) return refitted_folds(cost, system, point, weight, effort);
    // A high rank uses the cost of the full matrix: the search only has to find that it is not better there.
    const ReweightSettings settings = settings_at(cost, point, costly ? kDenseSolves : kRobustSolves);
    if (!reweight_inside(primal, settings, effort, others({}, weight.size()), weight)) return {};
    if (effort == Effort::kSearch) return refitted_folds(cost, system, point, weight, effort);
  } else if (!primal.solve(weight)) {
    return {};
  }
  if (cost.kind != Tuning::kLoo) return frozen_folds(cost, system, point.c, weight);
  // Leave-one-out: ξ / (1 − v h).
  return primal.residuals().array() / (1 - weight.array() * primal.leverages().array()).max(1e-12);
}

double cost_of(const TuningCost& cost, const LowRank& system, const TuningPoint& point, Effort effort) {
  const bool dense =
      dense_pays(cost, effort) && system.left > accuracy_of(effort) / point.c && system.rank() == cost.y.size() / 2;
  if (cost.kind == Tuning::kReml) return dense ? dense_reml(cost, point) : reml(system, cost.y, point.c);
  const Eigen::VectorXd residual = dense ? dense_residual(cost, point) : low_rank_residual(cost, system, point, effort);
  if (residual.size() == 0) return kNever;
  const double mean = cost.kind == Tuning::kLoo ? residual.cwiseAbs().mean() : mean_of_folds(residual, cost.folds);
  return std::isfinite(mean) ? mean * cost.scale : kNever;
}

}  // namespace

Tuning tuning_by_name(std::string_view name) {
  const auto at = std::find(kWords.begin(), kWords.end(), name);
  return at == kWords.end() ? Tuning::kBlocked : static_cast<Tuning>(at - kWords.begin());
}

const char* tuning_text(Tuning tuning) { return kTexts[static_cast<std::size_t>(tuning)]; }

double TuningCost::at(const TuningPoint& point, Effort effort) const {
  if (effort == Effort::kSearch && y.size() <= kFreshSamples) effort = Effort::kFinal;
  return cost_of(*this, system_for(*this, point.sigma2, point.c, effort), point, effort);
}

void TuningCost::set_frozen(std::span<TuningPoint> row) const {
  double c_max = 0;
  for (const TuningPoint& point : row) c_max = std::max(c_max, point.c);
  const LowRank finest = system_for(*this, row.front().sigma2, c_max, Effort::kFrozen);
  for (TuningPoint& point : row) {
    assert(point.sigma2 == row.front().sigma2);
    point.cost = cost_of(*this, coarser(finest, kSearchAccuracy / point.c), point, Effort::kFrozen);
  }
}

bool TuningCost::refits(const TuningPoint& point) const {
  return y.size() <= kFreshSamples || system_for(*this, point.sigma2, point.c, Effort::kSearch).rank() <= kRefitRank;
}

namespace {

constexpr double kMyriadStart = 1.5;  // the middle of the usual results of tuning
constexpr double kHuberHeld = 3;      // if it cannot be tuned: treats values beyond three sigma as outliers
constexpr double kTolerance = 0.01;   // of the simplex edges, log10
constexpr int kGridC = 7, kGridSigma2 = 8;

double parameter_start(WeightKind kind, bool searched) {
  if (kind != WeightKind::kHuber) return kMyriadStart;
  return searched ? usual_parameter(kind) : kHuberHeld;
}

bool cheaper(const TuningPoint& x, const TuningPoint& y) { return x.cost < y.cost; }

// A parameter that is searched, between powers of 10.
struct Axis {
  const char* name;
  double TuningPoint::*value;
  double low, high;
};

class TuningSearch {
 public:
  TuningSearch(const TuningCost& cost, const TuningSettings& settings)
      : cost_(cost), settings_(settings), small_(cost.y.size() <= kFreshSamples) {
    // A single input may need a far narrower kernel than several inputs.
    const double narrowest = cost.points.rows() == 1 ? -3.5 : -2;
    if (!settings.c) axes_.push_back({"c", &TuningPoint::c, -1, 6.5});
    if (!settings.sigma2) axes_.push_back({"sigma2", &TuningPoint::sigma2, narrowest, 2.5});
    // Leave-one-out uses fixed weights, and they depend on the held-out sample: it would choose a parameter so small
    // that only a few samples that agree with each other keep a weight.
    with_parameter_ = cost.weighs() && cost.settings.weight.has_parameter();
    if (with_parameter_ && !settings.parameter)
      axes_.push_back({"weight parameter", &TuningPoint::parameter, -1.3, 1.3});
  }

  Result<TuningResult> run() {
    grid_search();
    local_search();
    if (!std::isfinite(result_.best.cost)) return make_error("tuning", "found no c and sigma2 with a finite cost");
    if (!settings_.stopped()) take_final_cost();
    result_.stopped = settings_.stopped();
    add_warnings();
    return std::move(result_);
  }

 private:
  double evaluated(const TuningPoint& point, Effort effort) {
    const double cost = cost_.at(point, effort);
    count(point, cost);
    return cost;
  }

  void count(TuningPoint point, double cost) {
    const std::lock_guard lock(mutex_);
    ++result_.evaluations;
    point.cost = cost;
    shown_ = std::min(shown_, point, cheaper);
    if (settings_.progress) settings_.progress(result_.evaluations, expected_, shown_);
  }

  std::vector<double> grid_of(double TuningPoint::*value, const std::optional<double>& fixed, int points) const {
    if (fixed) return {*fixed};
    const Axis& axis = *std::find_if(axes_.begin(), axes_.end(), [&](const Axis& a) { return a.value == value; });
    std::vector<double> values;
    for (int i = 0; i < points; ++i)
      values.push_back(std::pow(10.0, axis.low + (axis.high - axis.low) * i / (points - 1)));
    return values;
  }

  // Every (sigma2, c) of the grid, and every parameter for a few of them, with fixed weights in the folds.
  void grid_search() {
    const auto sigmas = grid_of(&TuningPoint::sigma2, settings_.sigma2, kGridSigma2);
    const auto cs = grid_of(&TuningPoint::c, settings_.c, kGridC);
    std::vector<double> parameters = {
        settings_.parameter.value_or(parameter_start(cost_.settings.weight.kind, with_parameter_))};
    if (with_parameter_ && !settings_.parameter && small_) parameters = {0.2, 0.6, parameters[0], 4};
    for (const double parameter : parameters) {
      for (const double sigma2 : sigmas) {
        for (const double c : cs) result_.surface.push_back({c, sigma2, parameter, kNever});
      }
    }
    expected_ = static_cast<int>(result_.surface.size()) + starts() * simplex_evaluations();
    parallel_for(static_cast<int>(result_.surface.size() / cs.size()), settings_.threads, [&](int i) {
      if (settings_.stopped()) return;
      const auto row = std::span(result_.surface).subspan(static_cast<std::size_t>(i) * cs.size(), cs.size());
      if (!small_) cost_.set_frozen(row);
      for (TuningPoint& point : row) {
        if (small_ && settings_.stopped()) return;  // a point without a cost is not counted
        if (small_) point.cost = cost_.at(point, Effort::kSearch);
        count(point, point.cost);
      }
    });
    result_.best = *std::min_element(result_.surface.begin(), result_.surface.end(), cheaper);
  }

  int starts() const { return small_ ? 8 : 3; }
  int simplex_evaluations() const { return with_parameter_ ? 70 : 50; }

  // The best cells of the grid, without neighbouring cells.
  std::vector<TuningPoint> best_cells() const {
    std::vector<TuningPoint> sorted = result_.surface, chosen;
    std::stable_sort(sorted.begin(), sorted.end(), cheaper);
    for (const TuningPoint& p : sorted) {
      const bool near = std::any_of(chosen.begin(), chosen.end(), [&](const TuningPoint& q) {
        return std::fabs(std::log10(p.c / q.c)) + 1.5 * std::fabs(std::log10(p.sigma2 / q.sigma2)) < 1.8 &&
               std::fabs(std::log10(p.parameter / q.parameter)) < 0.3;
      });
      if (!near && std::isfinite(p.cost)) chosen.push_back(p);
      if (static_cast<int>(chosen.size()) == starts()) break;
    }
    return chosen;
  }

  // Of log10 of the free parameters. Frozen weights depend on the held-out data and would favour a small parameter: it
  // is fixed as well.
  TuningPoint simplex_from(const TuningPoint& from, double step, Effort effort) {
    const bool frozen = effort == Effort::kFrozen;
    std::vector<Axis> axes = axes_;
    if (frozen && axes.back().value == &TuningPoint::parameter) axes.pop_back();
    const auto n = static_cast<Eigen::Index>(axes.size());
    SimplexSettings simplex{Eigen::VectorXd(n), Eigen::VectorXd(n), step, simplex_evaluations()};
    simplex.x_tolerance = frozen ? 5 * kTolerance : kTolerance;
    simplex.f_tolerance = frozen ? 1e-4 : 1e-6;
    Eigen::VectorXd start(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Axis& axis = axes[static_cast<std::size_t>(i)];
      simplex.lower[i] = std::log10(std::pow(10, axis.low));
      simplex.upper[i] = std::log10(std::pow(10, axis.high));
      start[i] = std::log10(from.*axis.value);
    }
    const auto point_at = [&](const Eigen::VectorXd& x) {
      TuningPoint p = from;
      for (Eigen::Index i = 0; i < n; ++i) p.*axes[static_cast<std::size_t>(i)].value = std::pow(10.0, x[i]);
      return p;
    };
    const auto f = [&](const Eigen::VectorXd& x) { return evaluated(point_at(x), effort); };
    const Minimum end = minimise(f, start, simplex, [&] { return settings_.stopped(); });
    TuningPoint p = point_at(end.x);
    p.cost = end.value;
    return p;
  }

  void local_search() {
    if (axes_.empty()) return;  // the result is the cost of this point
    // The weights stay fixed in the folds until the last simplex: a tenth of the work, and nearly the same optimum.
    const bool frozen = cost_.robust() && !small_ && !(settings_.c && settings_.sigma2);
    std::vector<TuningPoint> cells = best_cells();
    parallel_for(static_cast<int>(cells.size()), settings_.threads, [&](int i) {
      if (settings_.stopped()) return;
      TuningPoint& cell = cells[static_cast<std::size_t>(i)];
      cell = simplex_from(cell, 0.6, frozen ? Effort::kFrozen : Effort::kSearch);
      if (frozen && !settings_.stopped()) cell.cost = evaluated(cell, Effort::kSearch);
    });
    if (!cells.empty()) result_.best = *std::min_element(cells.begin(), cells.end(), cheaper);
    usual_ = result_.best;
    if (cost_.weighs() && !cost_.refits(result_.best)) return;  // the grid search has already covered everything
    // Restart from the best point: a simplex that collapsed in a curved valley continues with new edges.
    for (const double step : {0.3, 0.05}) {
      if (step < 0.1 && !small_) break;
      if (!settings_.stopped() && !cells.empty())
        result_.best = std::min(result_.best, simplex_from(result_.best, step, Effort::kSearch), cheaper);
    }
  }

  // The final cost. If the rank is high, the search uses fixed weights in the folds; if these favoured the chosen
  // parameter, the best point with the usual parameter may be better.
  void take_final_cost() {
    const double promised = result_.best.cost;
    result_.best.cost = cost_.at(result_.best, Effort::kFinal);
    if (!with_parameter_ || usual_.parameter == result_.best.parameter || !std::isfinite(usual_.cost)) return;
    if (result_.best.cost <= 1.01 * promised) return;
    usual_.cost = cost_.at(usual_, Effort::kFinal);
    if (usual_.cost < result_.best.cost) result_.best = usual_;
  }

  void add_warnings() {
    if (cost_.robust() && cost_.kind == Tuning::kLoo && cost_.settings.weight.has_parameter() && !settings_.parameter)
      result_.warnings.push_back(
          fmt::format("leave-one-out cannot tune the weight's parameter: {:.4g} is used", result_.best.parameter));
    for (const Axis& axis : axes_) {
      const double x = std::log10(result_.best.*axis.value);
      if (x < axis.low + 0.02 || x > axis.high - 0.02)
        result_.warnings.push_back(fmt::format(
            "{} = {:.4g} is at the edge of the search range ({:.3g} to {:.3g}): the data do not determine it",
            axis.name, result_.best.*axis.value, std::pow(10, axis.low), std::pow(10, axis.high)));
    }
    if (settings_.c) return;
    // Flat cost: values of c a factor of 100 apart differ by less than half a percent.
    const double best = std::min_element(result_.surface.begin(), result_.surface.end(), cheaper)->cost;
    double low = kNever, high = 0;
    for (const TuningPoint& p : result_.surface) {
      if (p.cost - best > 0.005 * std::fabs(best)) continue;
      low = std::min(low, p.c);
      high = std::max(high, p.c);
    }
    if (high >= 1000 * low)
      result_.warnings.push_back(fmt::format(
          "the cost is flat: c from {:.3g} to {:.3g} differ by less than 0.5 % in cost; any value in this range fits",
          low, high));
  }

  const TuningCost& cost_;
  const TuningSettings& settings_;
  const bool small_;        ///< few samples: every evaluation by the final cost, and more starts
  std::vector<Axis> axes_;  ///< the parameter, if it is searched, last
  bool with_parameter_ = false;
  int expected_ = 0;
  std::mutex mutex_;
  TuningPoint shown_{1, 1, 1, kNever};
  TuningPoint usual_{1, 1, 1, kNever};  ///< the best before the parameter changed
  TuningResult result_;
};

}  // namespace

Result<TuningResult> tune(const TuningCost& cost, const TuningSettings& settings) {
  return TuningSearch(cost, settings).run();
}

}  // namespace prism::training
