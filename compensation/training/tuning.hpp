// SPDX-License-Identifier: MIT
// The search for (c, sigma2, weight parameter): a coarse log grid, then simplexes from its best points.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "compensation/training/held_out.hpp"
#include "compensation/training/low_rank.hpp"
#include "compensation/training/robust.hpp"

namespace prism::training {

/// Calls job(i) for i in [0, count), in any order and on at most `threads` threads; jobs must not throw.
template <class Job>
void parallel_for(int count, int threads, Job&& job) {
  std::atomic<int> next{0};
  const auto work = [&] {
    for (int i = next++; i < count; i = next++) job(i);
  };
  std::vector<std::thread> team;
  for (int t = 1; t < std::min(threads, count); ++t) team.emplace_back(work);
  work();
  for (std::thread& member : team) member.join();
}

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

/// blocked, shuffled, loo, reml; any other word is the default, blocked: command lines reject unknown words.
Tuning tuning_by_name(std::string_view name);
/// "blocked folds", "reml", …
const char* tuning_text(Tuning tuning);

struct TuningPoint {
  double c = 1, sigma2 = 1;
  double parameter = 1;  ///< of Huber or myriad; unused for the others
  double cost = 0;       ///< mean absolute held-out error in the target's units; kReml: −log-likelihood per sample
};

/// How exactly a cost is computed.
enum class Effort {
  kFrozen,  ///< for the grid search: the weights of the complete data stay fixed in the folds
  kSearch,  ///< for the local search: IRLS in each fold, started with the weights of the complete data
  kFinal,   ///< by the reference definition (30 re-weightings in each fold, from the unweighted solution), to ~1e-6
};

/// Thread-safe: evaluations share only constant data.
struct TuningCost {
  const Eigen::MatrixXd& points;
  const Eigen::VectorXd& y;
  double scale;  ///< converts normalised errors to the target's units
  Tuning kind;
  Folds folds;  ///< for the fold types
  ReweightSettings settings;

  double at(const TuningPoint& point, Effort effort) const;
  /// Sets the costs of points with the same sigma2 to those of kFrozen; decomposes once, for the largest c.
  void set_frozen(std::span<TuningPoint> row) const;
  /// Returns true if kSearch re-weights inside the folds; at high rank it uses fixed weights, as kFrozen does.
  bool refits(const TuningPoint& point) const;

  bool robust() const { return settings.weight.kind != WeightKind::kNone && kind != Tuning::kReml; }
  /// Leave-one-out tunes without weights: those of a closely following model favour the rows that agree with it, so
  /// that its cost falls below the noise. Gross outliers are already left out, and the cost is a mean of absolute
  /// errors.
  bool weighs() const { return robust() && kind != Tuning::kLoo; }
};

/// Called from any thread, one call at a time: evaluations done, evaluations expected, best so far.
using TuningProgress = std::function<void(int done, int expected, const TuningPoint& best)>;

struct TuningSettings {
  std::optional<double> c, sigma2, parameter;  ///< given values stay fixed
  int threads = 2;                             ///< 1 to 64; the result does not depend on it
  TuningProgress progress;
  const std::atomic<bool>* stop = nullptr;

  bool stopped() const { return stop && *stop; }
};

struct TuningResult {
  TuningPoint best;                  ///< cost is that of kFinal
  std::vector<TuningPoint> surface;  ///< the grid search, in rows of equal sigma2, with its own costs
  int evaluations = 0;
  bool stopped = false;               ///< ended early by the stop flag: the best result so far
  std::vector<std::string> warnings;  ///< a flat cost, an optimum at the edge of the search range
};

/// Deterministic: the same data and settings give the same result on any number of threads.
/// Errors: no parameters have a finite cost.
Result<TuningResult> tune(const TuningCost& cost, const TuningSettings& settings);

}  // namespace prism::training
