// SPDX-License-Identifier: MIT
#include "compensation/training/tuning.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>
#include <span>

#include "compensation/kernel.hpp"
#include "compensation/training/dense.hpp"
#include "compensation/training/minimise.hpp"
#include "compensation/training/parallel.hpp"

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

namespace {

constexpr double kMyriadStart = 1.5;  // the middle of the usual results of tuning
constexpr double kHuberHeld = 3;      // if it cannot be tuned: treats values beyond three sigma as outliers
constexpr double kTolerance = 0.01;   // of the simplex edges, log10
constexpr int kGridC = 7, kGridSigma2 = 8;

double parameter_start(WeightKind kind, bool searched) {
  if (kind != WeightKind::kHuber) return kMyriadStart;
  return searched ? usual_parameter(kind) : kHuberHeld;
}

class TuningSearch {
 public:
  TuningSearch(const TuningCost& cost, Eigen::Index samples, const TuningSettings& settings,
               const TuningProgress& progress, const std::atomic<bool>* stop)
      : cost_(cost), samples_(samples), settings_(settings), progress_(progress), stop_(stop) {
    // Leave-one-out uses fixed weights, and they depend on the held-out sample: it would choose a parameter so small
    // that only a few samples that agree with each other keep a weight.
    with_parameter_ = cost.robust() && cost.settings().weight.has_parameter() && cost.kind() != Tuning::kLoo;
  }

  Result<TuningResult> run() {
    grid_search();
    local_search();
    if (!std::isfinite(result_.best.cost)) return make_error("tuning", "found no c and sigma2 with a finite cost");
    if (!stopped()) take_final_cost();
    result_.stopped = stopped();
    add_warnings();
    return std::move(result_);
  }

 private:
  bool stopped() const { return stop_ != nullptr && stop_->load(); }

  double evaluated(const TuningPoint& point, bool frozen) {
    const double cost = frozen ? cost_.frozen_cost(point) : cost_.evaluate(point);
    count(point, cost);
    return cost;
  }

  void count(const TuningPoint& point, double cost) {
    const std::lock_guard lock(mutex_);
    ++result_.evaluations;
    TuningPoint shown = point;
    shown.cost = cost;
    if (cost < shown_.cost) shown_ = shown;
    if (progress_) progress_(result_.evaluations, expected_, shown_);
  }

  std::vector<double> axis(const std::optional<double>& fixed, double low, double high, int count) const {
    if (fixed) return {*fixed};
    std::vector<double> values;
    for (int i = 0; i < count; ++i) values.push_back(std::pow(10.0, low + (high - low) * i / (count - 1)));
    return values;
  }

  // Every (sigma2, c) of the grid, and every parameter for a few of them, with fixed weights in the folds.
  void grid_search() {
    const TuningBounds& b = settings_.bounds;
    const auto sigmas = axis(settings_.sigma2, b.sigma2_min, b.sigma2_max, kGridSigma2);
    const auto cs = axis(settings_.c, b.c_min, b.c_max, kGridC);
    std::vector<double> parameters = {
        settings_.parameter.value_or(parameter_start(cost_.settings().weight.kind, with_parameter_))};
    if (with_parameter_ && !settings_.parameter && small_data()) parameters = {0.2, 0.6, parameters[0], 4};
    for (const double parameter : parameters) {
      for (const double sigma2 : sigmas) {
        for (const double c : cs) result_.surface.push_back({c, sigma2, parameter, kNever});
      }
    }
    expected_ = static_cast<int>(result_.surface.size()) + starts() * simplex_evaluations();
    const int rows = static_cast<int>(result_.surface.size() / cs.size());
    parallel_for(rows, settings_.threads, [&](int i) {
      if (!stopped()) grid_row(std::span(result_.surface).subspan(static_cast<std::size_t>(i) * cs.size(), cs.size()));
    });
    // If everything is given, there is no search: the result is the cost of this point.
    result_.best = *std::min_element(result_.surface.begin(), result_.surface.end(),
                                     [](const TuningPoint& x, const TuningPoint& y) { return x.cost < y.cost; });
  }

  void grid_row(std::span<TuningPoint> row) {
    if (!small_data()) cost_.frozen_costs(row);
    for (TuningPoint& point : row) {
      if (small_data()) {
        if (stopped()) return;  // a point without a cost is not counted
        point.cost = cost_.evaluate(point);
      }
      count(point, point.cost);
    }
  }

  bool small_data() const { return samples_ <= 200; }
  bool parameter_moves() const { return with_parameter_ && !settings_.parameter && !frozen_; }
  int starts() const { return settings_.starts > 0 ? settings_.starts : small_data() ? 8 : 3; }
  int simplex_evaluations() const { return with_parameter_ ? 70 : 50; }

  // The best cells of the grid, without neighbouring cells.
  std::vector<TuningPoint> best_cells() const {
    std::vector<TuningPoint> sorted = result_.surface, chosen;
    std::stable_sort(sorted.begin(), sorted.end(), [](const auto& x, const auto& y) { return x.cost < y.cost; });
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

  // Search coordinates: log10 of the free parameters.
  Eigen::VectorXd coordinates(const TuningPoint& p) const {
    std::vector<double> x;
    if (!settings_.c) x.push_back(std::log10(p.c));
    if (!settings_.sigma2) x.push_back(std::log10(p.sigma2));
    if (parameter_moves()) x.push_back(std::log10(p.parameter));
    return Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(x.size()));
  }

  TuningPoint point_at(const Eigen::VectorXd& x, TuningPoint p) const {
    Eigen::Index i = 0;
    if (!settings_.c) p.c = std::pow(10.0, x[i++]);
    if (!settings_.sigma2) p.sigma2 = std::pow(10.0, x[i++]);
    if (parameter_moves()) p.parameter = std::pow(10.0, x[i++]);
    return p;
  }

  SimplexSettings simplex_settings(double step) const {
    const TuningBounds& b = settings_.bounds;
    SimplexSettings s;
    s.lower = coordinates({std::pow(10, b.c_min), std::pow(10, b.sigma2_min), std::pow(10, b.parameter_min), 0});
    s.upper = coordinates({std::pow(10, b.c_max), std::pow(10, b.sigma2_max), std::pow(10, b.parameter_max), 0});
    s.step = Eigen::VectorXd::Constant(s.lower.size(), step);
    s.max_evaluations = simplex_evaluations();
    s.x_tolerance = kTolerance;
    s.f_tolerance = 1e-6;
    return s;
  }

  TuningPoint simplex_from(const TuningPoint& from, double step, bool frozen) {
    const auto f = [&](const Eigen::VectorXd& x) { return evaluated(point_at(x, from), frozen); };
    SimplexSettings settings = simplex_settings(step);
    if (frozen) settings.x_tolerance = 5 * kTolerance, settings.f_tolerance = 1e-4;
    const SimplexResult end = minimise(f, coordinates(from), settings, [&] { return stopped(); });
    TuningPoint p = point_at(end.x, from);
    p.cost = end.value;
    return p;
  }

  void local_search() {
    if (coordinates(result_.best).size() == 0) {
      if (!stopped()) result_.best.cost = evaluated(result_.best, false);
      return;
    }
    // The weights stay fixed in the folds until the last simplex: a tenth of the work, and nearly the same optimum.
    // Their parameter is also fixed, because fixed weights depend on the held-out data and would favour a small
    // parameter.
    frozen_ = cost_.robust() && !small_data() && !(settings_.c && settings_.sigma2);
    std::vector<TuningPoint> cells = best_cells();
    parallel_for(static_cast<int>(cells.size()), settings_.threads, [&](int i) {
      if (stopped()) return;
      TuningPoint& cell = cells[static_cast<std::size_t>(i)];
      cell = simplex_from(cell, 0.6, frozen_);
      if (frozen_ && !stopped()) cell.cost = evaluated(cell, false);
    });
    frozen_ = false;
    const auto better = [](const TuningPoint& x, const TuningPoint& y) { return x.cost < y.cost; };
    if (!cells.empty()) result_.best = *std::min_element(cells.begin(), cells.end(), better);
    usual_ = result_.best;
    if (cost_.robust() && cost_.kind() != Tuning::kLoo && !cost_.refits(result_.best))
      return;  // the grid search has already covered everything
    // Restart from the best point: a simplex that collapsed in a curved valley continues with new edges.
    for (const double step : {0.3, 0.05}) {
      if (step < 0.1 && !small_data()) break;
      if (!stopped() && !cells.empty())
        result_.best = std::min(result_.best, simplex_from(result_.best, step, false), better);
    }
  }

  // The final cost. If the rank is high, the search uses fixed weights in the folds; if these favoured the chosen
  // parameter, the best point with the usual parameter may be better.
  void take_final_cost() {
    const double promised = result_.best.cost;
    result_.best.cost = cost_.final_cost(result_.best);
    if (!with_parameter_ || usual_.parameter == result_.best.parameter || !std::isfinite(usual_.cost)) return;
    if (result_.best.cost <= 1.01 * promised) return;
    usual_.cost = cost_.final_cost(usual_);
    if (usual_.cost < result_.best.cost) result_.best = usual_;
  }

  void add_warnings() {
    const TuningBounds& b = settings_.bounds;
    const auto edge = [&](const char* name, double value, double low, double high) {
      const double x = std::log10(value);
      if (x < low + 0.02 || x > high - 0.02) {
        result_.warnings.push_back(fmt::format(
            "{} = {:.4g} is at the edge of the search range ({:.3g} to {:.3g}): the data do not determine it", name,
            value, std::pow(10, low), std::pow(10, high)));
      }
    };
    if (cost_.robust() && cost_.kind() == Tuning::kLoo && cost_.settings().weight.has_parameter() &&
        !settings_.parameter) {
      result_.warnings.push_back(
          fmt::format("leave-one-out cannot tune the weight's parameter: {:.4g} is used", result_.best.parameter));
    }
    if (!settings_.c) edge("c", result_.best.c, b.c_min, b.c_max);
    if (!settings_.sigma2) edge("sigma2", result_.best.sigma2, b.sigma2_min, b.sigma2_max);
    if (with_parameter_ && !settings_.parameter)
      edge("weight parameter", result_.best.parameter, b.parameter_min, b.parameter_max);
    warn_of_flatness();
  }

  // Flat cost: values of c a factor of 100 apart differ by less than half a percent.
  void warn_of_flatness() {
    if (settings_.c) return;
    const double best =
        std::min_element(result_.surface.begin(), result_.surface.end(), [](const auto& x, const auto& y) {
          return x.cost < y.cost;
        })->cost;
    double low = kNever, high = 0;
    for (const TuningPoint& p : result_.surface) {
      if (p.cost - best > 0.005 * std::fabs(best)) continue;
      low = std::min(low, p.c);
      high = std::max(high, p.c);
    }
    if (high >= 1000 * low) {
      result_.warnings.push_back(fmt::format(
          "the cost is flat: c from {:.3g} to {:.3g} differ by less than 0.5 % in cost; any value in this range fits",
          low, high));
    }
  }

  const TuningCost& cost_;
  Eigen::Index samples_;
  const TuningSettings& settings_;
  const TuningProgress& progress_;
  const std::atomic<bool>* stop_;
  bool with_parameter_ = false, frozen_ = false;
  int expected_ = 0;
  std::mutex mutex_;
  TuningPoint shown_{1, 1, 1, kNever};
  TuningPoint usual_{1, 1, 1, kNever};  ///< the best before the parameter changed
  TuningResult result_;
};

}  // namespace

TuningBounds bounds_for(Eigen::Index inputs) {
  TuningBounds bounds;
  if (inputs == 1) bounds.sigma2_min = -3.5;
  return bounds;
}

Result<TuningResult> tune(const TuningCost& cost, Eigen::Index samples, const TuningSettings& settings,
                          const TuningProgress& progress, const std::atomic<bool>* stop) {
  return TuningSearch(cost, samples, settings, progress, stop).run();
}

}  // namespace prism::training
