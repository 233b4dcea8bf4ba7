// SPDX-License-Identifier: MIT
#include "compensation/training/tuning.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <span>

#include "compensation/training/parallel.hpp"
#include "compensation/training/simplex.hpp"

namespace prism::training {
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
