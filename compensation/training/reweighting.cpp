// SPDX-License-Identifier: MIT
#include "compensation/training/reweighting.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "compensation/evaluation/statistics.hpp"

namespace prism::training {
namespace {

constexpr std::array<std::string_view, 5> kNames = {"none", "huber", "hampel", "logistic", "myriad"};
constexpr double kHampelB1 = 2.5, kHampelB2 = 3.0;

std::vector<double> values(const Eigen::VectorXd& v) { return {v.begin(), v.end()}; }

// The p-quantile at n p + 0.5 (Hazen), with linear interpolation.
double quantile(const Eigen::VectorXd& sorted, double p) {
  const double at = static_cast<double>(sorted.size()) * p - 0.5;
  const double low = std::clamp(std::floor(at), 0.0, static_cast<double>(sorted.size() - 1));
  const Eigen::Index i = static_cast<Eigen::Index>(low), j = std::min(i + 1, sorted.size() - 1);
  const double part = std::clamp(at - low, 0.0, 1.0);
  return sorted[i] + part * (sorted[j] - sorted[i]);
}

double mad_scale(const Eigen::VectorXd& r) { return kPaperMadToSd * evaluation::median_absolute_deviation(values(r)); }

double iqr_scale(Eigen::VectorXd r) {
  std::sort(r.begin(), r.end());
  return (quantile(r, 0.75) - quantile(r, 0.25)) / (2 * 0.6745);
}

}  // namespace

const char* weight_name(WeightKind kind) { return kNames[static_cast<std::size_t>(kind)].data(); }

WeightKind weight_by_name(std::string_view name) {
  const auto at = std::find(kNames.begin(), kNames.end(), name);
  return at == kNames.end() ? WeightKind::kNone : static_cast<WeightKind>(at - kNames.begin());
}

double WeightFunction::operator()(double u) const {
  const double a = std::fabs(u);
  switch (kind) {
    case WeightKind::kHuber:
      return a < parameter ? 1 : parameter / a;
    case WeightKind::kHampel:
      if (a <= kHampelB1) return 1;
      return a <= kHampelB2 ? std::max((kHampelB2 - a) / (kHampelB2 - kHampelB1), hampel_floor) : hampel_floor;
    case WeightKind::kLogistic:
      return a > 0 ? std::tanh(a) / a : 1;
    case WeightKind::kMyriad:
      return parameter * parameter / (parameter * parameter + u * u);
    default:
      return 1;
  }
}

double robust_scale(const Eigen::VectorXd& residuals, ScaleKind kind) {
  const double chosen = kind == ScaleKind::kMad ? mad_scale(residuals) : iqr_scale(residuals);
  if (chosen > 0) return chosen;
  const double other = std::max(mad_scale(residuals), iqr_scale(residuals));
  if (other > 0) return other;
  return 1.2533 * (residuals.array() - evaluation::median_of(values(residuals))).abs().mean();
}

Eigen::VectorXd weights_of(const Eigen::VectorXd& residuals, double scale, const WeightFunction& function) {
  if (!(scale > 0)) return Eigen::VectorXd::Ones(residuals.size());
  return residuals.unaryExpr([&](double r) { return function(r / scale); });
}

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
    const double change = (step.residual - step.residual_before).cwiseAbs().maxCoeff();
    return change <= tolerance * report.scale ? AfterStep::kConverged : AfterStep::kContinue;
  };
}

StepRule weights_settled() {
  return [](const ReweightStep& step, ReweightReport& report) {
    constexpr double kSettled = 1e-3;
    constexpr int kPatience = 20;
    const double moved = (step.weight - step.weight_before).cwiseAbs().maxCoeff();
    const double change = report.oscillating ? 2 * moved : moved;  // an average moves by half
    report.oscillating = report.solves >= kPatience;
    return change < kSettled ? AfterStep::kConverged : AfterStep::kContinue;
  };
}

}  // namespace prism::training
