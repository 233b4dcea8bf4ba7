// SPDX-License-Identifier: MIT
// The search for (c, sigma2, weight parameter): a coarse log grid, then simplexes from its best points.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "compensation/training/irlssvm.hpp"
#include "compensation/training/low_rank.hpp"

namespace prism::training {

// The cost of one choice of (c, sigma2, weight parameter): held-out errors, from a low-rank system if it is accurate
// enough.

/// The cost if no fit is possible.
inline constexpr double kNever = std::numeric_limits<double>::infinity();

enum class Tuning {
  kBlocked,   ///< contiguous blocks of each run held out together: the default for time series
  kShuffled,  ///< folds sampled by the seed: the paper's ten-fold cross-validation
  kGiven,     ///< folds given by the user
  kLoo,       ///< leave-one-out, unweighted
  kReml,      ///< restricted likelihood, unweighted
};

/// shuffled, loo, reml; any other word is the default, blocked: command lines reject unknown words.
Tuning tuning_by_name(std::string_view name);

struct TuningPoint {
  double c = 1, sigma2 = 1;
  double parameter = 1;  ///< of Huber or myriad; unused for the others
  double cost = 0;       ///< mean absolute held-out error in the target's units; kReml: −log-likelihood per sample
};

/// Thread-safe: evaluations share only constant data.
class TuningCost {
 public:
  /// `scale` converts normalised errors to the target's units. Only the fold types use the folds.
  TuningCost(const Eigen::MatrixXd& points, const Eigen::VectorXd& y, double scale, Tuning kind, Folds folds,
             ReweightSettings settings);

  /// The cost that the local search minimises. Fold types with weights: IRLS in each fold, started with the weights of
  /// the complete data.
  double evaluate(const TuningPoint& point) const;
  /// A cheaper cost for the grid search: the weights of the complete data stay fixed in the folds.
  double frozen_cost(const TuningPoint& point) const;
  /// Sets the costs of points with the same sigma2 to frozen_cost(); decomposes once, for the largest c.
  void frozen_costs(std::span<TuningPoint> row) const;
  /// The cost by the reference definition (30 re-weightings in each fold, from the unweighted solution), to ~1e-6.
  double final_cost(const TuningPoint& point) const;

  /// Returns true if evaluate() re-weights inside the folds; at high rank it uses fixed weights, as frozen_cost() does.
  bool refits(const TuningPoint& point) const;

  bool robust() const { return settings_.weight.kind != WeightKind::kNone && kind_ != Tuning::kReml; }
  Tuning kind() const { return kind_; }
  const ReweightSettings& settings() const { return settings_; }

 private:
  /// The settings with the weight parameter of a point and at most `limit` solves.
  ReweightSettings settings_at(const TuningPoint& point, int limit) const;
  bool dense_pays(bool exact) const;
  LowRank system_for(double sigma2, double tolerance, bool exact) const;
  double cost_of(const LowRank& system, const TuningPoint& point, double accuracy, bool frozen, bool exact) const;
  Eigen::VectorXd held_out(const LowRank& system, const TuningPoint& point, bool frozen, bool exact) const;
  Eigen::VectorXd frozen_folds(const LowRank& system, double c, const Eigen::VectorXd& weight) const;
  Eigen::VectorXd refitted_folds(const LowRank& system, const TuningPoint& point, const Eigen::VectorXd& start,
                                 bool exact) const;
  double reml(const LowRank& system, double c) const;
  Eigen::VectorXd held_out(const TuningPoint& point) const;
  double reml(const TuningPoint& point) const;
  double mean_of_folds(const Eigen::VectorXd& residual) const;

  const Eigen::MatrixXd& points_;
  const Eigen::VectorXd& y_;
  double scale_;
  Tuning kind_;
  Folds folds_;
  std::vector<std::vector<Eigen::Index>> members_;
  ReweightSettings settings_;
};

/// log10 limits of the search, in normalised units.
struct TuningBounds {
  double c_min = -1, c_max = 6.5, sigma2_min = -2, sigma2_max = 2.5;
  double parameter_min = -1.3, parameter_max = 1.3;
};
/// A single input may need a far narrower kernel than several inputs.
TuningBounds bounds_for(Eigen::Index inputs);

struct TuningSettings {
  // Given values stay fixed.
  std::optional<double> c, sigma2, parameter;
  TuningBounds bounds;
  int starts = 0;   ///< number of simplexes; 0: chosen by the size of the data
  int threads = 2;  ///< 1 to 64; the result does not depend on it
};

/// Called from any thread, one call at a time: evaluations done, evaluations expected, best so far.
using TuningProgress = std::function<void(int done, int expected, const TuningPoint& best)>;

struct TuningResult {
  TuningPoint best;                  ///< cost is final_cost()
  std::vector<TuningPoint> surface;  ///< the grid search, in rows of equal sigma2, with its own costs
  int evaluations = 0;
  bool stopped = false;               ///< ended early by the stop flag: the best result so far
  std::vector<std::string> warnings;  ///< a flat cost, an optimum at the edge of the search range
};

/// Deterministic: the same data and settings give the same result on any number of threads.
/// Errors: no parameters have a finite cost.
Result<TuningResult> tune(const TuningCost& cost, Eigen::Index samples, const TuningSettings& settings,
                          const TuningProgress& progress = {}, const std::atomic<bool>* stop = nullptr);

}  // namespace prism::training
