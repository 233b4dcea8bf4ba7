// SPDX-License-Identifier: MIT
#include "compensation/training/between_run_error.hpp"

#include <algorithm>
#include <cmath>

#include "compensation/evaluation/statistics.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/kernel.hpp"
#include "compensation/training/lssvm.hpp"
#include "compensation/training/reweighting.hpp"

namespace prism::training {
namespace {

constexpr int kBlocks = 10;
constexpr std::size_t kFewestSamples = 40;

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

std::vector<Eigen::Index> weighed(const Eigen::VectorXd& weight) {
  std::vector<Eigen::Index> kept;
  for (const Eigen::Index i : thinned(weight.size(), kErrorSamples)) {
    if (weight[i] > 0) kept.push_back(i);
  }
  return kept;
}

}  // namespace

Folds held_out_folds(const std::vector<int>& recordings) {
  if (recordings.size() < kFewestSamples) return {};
  const int count = 1 + *std::max_element(recordings.begin(), recordings.end());
  return count >= 3 ? recordings : blocked_folds(recordings, kBlocks);
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

HeldOutErrors hold_out_lssvm(const NormalisedData& data, const Eigen::VectorXd& weight,
                             const std::vector<int>& recordings, double c, double sigma2) {
  const std::vector<Eigen::Index> kept = weighed(weight);
  HeldOutErrors held;
  held.folds = held_out_folds(taken(recordings, kept));
  if (held.folds.empty()) return held;
  held.samples = kept;
  const Eigen::VectorXd noise = (c * weight(kept).array()).inverse();
  const Eigen::MatrixXd centres = data.x(Eigen::all, kept);
  const auto factor = LssvmFactor::make(compensation::kernel_matrix(centres, {sigma2}), noise, data.y(kept));
  if (!factor) return {};
  Eigen::VectorXd variance;
  const double scale = data.constants.target_scale;
  held.error = scale * factor->leave_fold_out(held.folds, variance);
  held.model_variance = scale * scale * factor->prior_variance() * (variance - noise).cwiseMax(0);
  return held;
}

}  // namespace prism::training
