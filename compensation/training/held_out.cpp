// SPDX-License-Identifier: MIT
#include "compensation/training/held_out.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <random>

#include "compensation/evaluation/drift_test.hpp"
#include "compensation/evaluation/statistics.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/training/robust.hpp"

namespace prism::training {
namespace {

template <class Number>
std::vector<int> without_gaps(const std::vector<Number>& numbers) {
  std::map<Number, int> place;
  for (const Number number : numbers) place.emplace(number, 0);
  int next = 0;
  for (auto& [number, at] : place) at = next++;
  std::vector<int> result;
  for (const Number number : numbers) result.push_back(place[number]);
  return result;
}

}  // namespace

Folds shuffled_folds(std::size_t n, int k, std::uint64_t seed) {
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::mt19937_64 random(seed);
  // std::shuffle may differ between libraries; this shuffle is the same everywhere.
  for (std::size_t i = n; i > 1; --i) std::swap(order[i - 1], order[random() % i]);
  const std::size_t folds = std::clamp<std::size_t>(static_cast<std::size_t>(k), 1, n), size = n / folds;
  Folds fold(n);
  for (std::size_t i = 0; i < n; ++i) fold[order[i]] = static_cast<int>(std::min(i / size, folds - 1));
  return fold;
}

Folds blocked_folds(const std::vector<int>& runs, int k) {
  const std::size_t n = runs.size();
  Folds fold(n);
  int next = 0;
  for (const Rows& run : fold_members(runs)) {
    if (run.empty()) continue;
    const std::size_t length = run.size();
    const double share = static_cast<double>(k) * static_cast<double>(length) / static_cast<double>(n);
    const std::size_t blocks = std::clamp<std::size_t>(static_cast<std::size_t>(std::lround(share)), 1, length);
    for (const Eigen::Index i : run)
      fold[static_cast<std::size_t>(i)] =
          next + static_cast<int>((static_cast<std::size_t>(i - run[0])) * blocks / length);
    next += static_cast<int>(blocks);
  }
  return fold;
}

Result<Folds> folds_from(const std::vector<double>& column) {
  for (const double value : column) {
    if (value != std::floor(value)) return make_error("fold column", fmt::format("found {}, expected integers", value));
  }
  Folds folds = without_gaps(column);
  if (fold_count(folds) < 2)
    return make_error("fold column", fmt::format("found {} folds, expected at least 2", fold_count(folds)));
  return folds;
}

std::vector<int> numbered(const std::vector<int>& numbers) { return without_gaps(numbers); }

int fold_count(const Folds& folds) { return folds.empty() ? 0 : *std::max_element(folds.begin(), folds.end()) + 1; }

Rows thinned(Eigen::Index rows, Eigen::Index most) {
  const Eigen::Index step = (rows + most - 1) / most;
  Rows part;
  for (Eigen::Index i = 0; i < rows; i += step) part.push_back(i);
  return part;
}

std::vector<int> taken(const std::vector<int>& of_rows, const Rows& rows) {
  std::vector<int> part;
  for (const Eigen::Index i : rows) part.push_back(of_rows[static_cast<std::size_t>(i)]);
  return part;
}

Rows others(const Rows& members, Eigen::Index count) {
  Rows all(static_cast<std::size_t>(count)), rest;
  std::iota(all.begin(), all.end(), Eigen::Index{0});
  std::set_difference(all.begin(), all.end(), members.begin(), members.end(), std::back_inserter(rest));
  return rest;
}

std::vector<Rows> fold_members(const Folds& folds) {
  std::vector<Rows> members(static_cast<std::size_t>(fold_count(folds)));
  for (std::size_t i = 0; i < folds.size(); ++i)
    members[static_cast<std::size_t>(folds[i])].push_back(static_cast<Eigen::Index>(i));
  return members;
}

Eigen::VectorXd held_out(const Folds& folds, const FoldResidual& residual) {
  const auto n = static_cast<Eigen::Index>(folds.size());
  Eigen::VectorXd all(n);
  for (const Rows& members : fold_members(folds)) {
    if (members.empty()) continue;
    const Eigen::VectorXd part = residual(others(members, n), members);
    if (part.size() == 0) return {};
    all(members) = part;
  }
  return all;
}

double mean_of_folds(const Eigen::VectorXd& residual, const Folds& folds) {
  double total = 0;
  for (const Rows& fold : fold_members(folds)) total += residual(fold).cwiseAbs().mean();
  return total / static_cast<double>(fold_count(folds));
}

double order_statistic(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

double guard_of(std::vector<double> variances, double none) {
  return variances.empty() ? none : 12 * order_statistic(std::move(variances), 0.99);
}

namespace {

// White noise, independent of slow drift: the difference of neighbours is √2 of it.
double noise_of(const Eigen::VectorXd& residual) {
  const Eigen::Index n = residual.size() - 1;
  const Eigen::VectorXd steps = (residual.tail(n) - residual.head(n)).cwiseAbs();
  return kPaperMadToSd * evaluation::median_of({steps.begin(), steps.end()}) / std::sqrt(2.0);
}

// The 95 % quantile of |error| / sd_mean.
double reach(const HeldOutErrors& held, const compensation::BetweenRunError& spread) {
  std::vector<double> ratio;
  for (Eigen::Index i = 0; i < held.error.size(); ++i) {
    const compensation::PredictiveUncertainty known{held.model_variance[i], 0, 1, 0, spread, false};
    ratio.push_back(std::abs(held.error[i]) / compensation::stated({}, known, 1).sd_mean_deg_per_h);
  }
  return order_statistic(std::move(ratio), 0.95);
}

}  // namespace

Folds held_out_folds(const std::vector<int>& recordings) {
  constexpr int kBlocks = 10;
  constexpr std::size_t kFewestSamples = 40;
  if (recordings.size() < kFewestSamples) return {};
  return fold_count(recordings) >= 3 ? recordings : blocked_folds(recordings, kBlocks);
}

HeldOutErrors held_out_errors(Rows samples, const std::vector<int>& recordings, double scale,
                              const FoldResidual& residual) {
  HeldOutErrors held;
  held.folds = held_out_folds(taken(recordings, samples));
  held.error = scale * held_out(held.folds, residual);
  if (held.error.size() == 0) return {};
  held.model_variance = Eigen::VectorXd::Zero(held.error.size());
  held.samples = std::move(samples);
  return held;
}

std::optional<compensation::BetweenRunError> between_run_error_of(const HeldOutErrors& held,
                                                                  const Eigen::VectorXd& residual, double target_sd,
                                                                  const std::vector<int>& recordings) {
  if (fold_count(held.folds) < 2 || !held.error.allFinite() || !held.model_variance.allFinite()) return std::nullopt;
  compensation::BetweenRunError spread;
  spread.noise_deg_per_h = noise_of(residual);
  if (recordings.front() == recordings.back()) spread.offset_deg_per_h = compensation::kAssumedOffset * target_sd;
  spread.blocks = fold_count(held.folds);
  spread.samples = static_cast<int>(held.error.size());
  if (reach(held, spread) <= 2) return spread;
  double low = 0, high = held.error.cwiseAbs().maxCoeff() + 1e-300;
  for (int i = 0; i < 60 && high - low > 1e-6 * high; ++i) {
    spread.nuisance_deg_per_h = (low + high) / 2;
    (reach(held, spread) > 2 ? low : high) = spread.nuisance_deg_per_h;
  }
  spread.nuisance_deg_per_h = high;
  return spread;
}

std::optional<compensation::MonitorSettings> monitor_of(const HeldOutErrors& held,
                                                        const compensation::BetweenRunError& spread,
                                                        const std::vector<int>& recordings,
                                                        const Eigen::VectorXd& time_s, double window_s) {
  if (held.error.size() < 2 || !held.error.allFinite()) return std::nullopt;
  evaluation::Residuals residuals{{held.error.begin(), held.error.end()}, taken(recordings, held.samples), 1, window_s};
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < held.samples.size(); ++i)
    steps_s.push_back(time_s[held.samples[i]] - time_s[held.samples[i - 1]]);
  residuals.every = std::max(1, static_cast<int>(std::lround(evaluation::median_of(steps_s) / window_s)));
  return evaluation::monitor_settings(std::move(residuals), spread.factor * spread.offset_deg_per_h, 0);
}

}  // namespace prism::training
