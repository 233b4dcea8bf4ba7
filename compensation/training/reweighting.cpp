// SPDX-License-Identifier: MIT
#include "compensation/training/reweighting.hpp"

#include <utility>

namespace prism::training {

Result<ReweightReport> reweight(const ReweightSettings& settings, Eigen::VectorXd& weight, const WeightedSolve& solve,
                                const StepRule& rule) {
  auto residual = solve(weight);
  if (!residual) return tl::unexpected<Error>(residual.error());
  ReweightReport report;
  report.converged = settings.weight.kind == WeightKind::kNone;
  AfterStep after = AfterStep::kContinue;
  while (!report.converged && after != AfterStep::kStop && report.solves < settings.limit) {
    report.scale = robust_scale(*residual, settings.scale);
    Eigen::VectorXd next = weights_of(*residual, report.scale, settings.weight).cwiseMax(settings.min_weight);
    if (report.oscillating) next = (next + weight) / 2;
    auto next_residual = solve(next);
    if (!next_residual) return tl::unexpected<Error>(next_residual.error());
    ++report.solves;
    after = rule({weight, next, *residual, *next_residual}, report);
    report.converged = after == AfterStep::kConverged;
    weight = std::move(next);
    residual = std::move(next_residual);
  }
  report.dropped = static_cast<int>((weight.array() <= 0).count());
  return report;
}

StepRule residuals_within(double tolerance) {
  return [tolerance](const ReweightStep& step, ReweightReport& report) {
    const Eigen::VectorXd change = step.residual - step.residual_before;
    report.change.push_back(change.norm());
    return change.cwiseAbs().maxCoeff() <= tolerance * report.scale ? AfterStep::kConverged : AfterStep::kContinue;
  };
}

StepRule weights_settled() {
  return [](const ReweightStep& step, ReweightReport& report) {
    constexpr double kSettled = 1e-3;
    constexpr int kPatience = 20;
    const double moved = (step.weight - step.weight_before).cwiseAbs().maxCoeff();
    report.change.push_back(report.oscillating ? 2 * moved : moved);  // an average moves by half
    report.oscillating = report.solves >= kPatience;
    return report.change.back() < kSettled ? AfterStep::kConverged : AfterStep::kContinue;
  };
}

}  // namespace prism::training
