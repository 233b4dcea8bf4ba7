// SPDX-License-Identifier: MIT
#include "compensation/training/robust.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "compensation/evaluation/statistics.hpp"

namespace prism::training {
namespace {

constexpr std::array<std::string_view, 5> kNames = {"none", "huber", "hampel", "logistic", "myriad"};
constexpr double kHampelB1 = 2.5, kHampelB2 = 3.0;

std::vector<double> values(const Eigen::VectorXd& v) { return {v.begin(), v.end()}; }

// The p-quantile at n p + 0.5 (Hazen), with linear interpolation.
double quantile(const Eigen::VectorXd& sorted, double p) {
  const double at = std::max(static_cast<double>(sorted.size()) * p - 0.5, 0.0);
  const Eigen::Index i = static_cast<Eigen::Index>(at), j = std::min(i + 1, sorted.size() - 1);
  return sorted[i] + (at - static_cast<double>(i)) * (sorted[j] - sorted[i]);
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

Result<ReweightReport> reweight(const ReweightSettings& settings, Eigen::VectorXd& weight, const WeightedSolve& solve,
                                const StepRule& rule) {
  auto residual = solve(weight);
  if (!residual) return tl::unexpected<Error>(residual.error());
  ReweightReport report;
  report.converged = settings.weight.kind == WeightKind::kNone;
  AfterStep after = AfterStep::kContinue;
  while (!report.converged && after != AfterStep::kStop && report.solves < settings.limit) {
    report.scale = robust_scale(*residual, settings.scale);
    Eigen::VectorXd next = Eigen::VectorXd::Ones(weight.size());
    if (report.scale > 0) next = residual->unaryExpr([&](double r) { return settings.weight(r / report.scale); });
    next = next.cwiseMax(settings.min_weight);
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

namespace {

constexpr Eigen::Index kFewest = 20, kNeighbours = 65, kCompared = 2000;
constexpr int kPasses = 6;  // each pass finds the rows that the previous ones hid

double median_among(std::vector<double> values) { return order_statistic(std::move(values), 0.5); }

// Distance of each row's target to the median of its neighbours in time.
Eigen::VectorXd from_time(const Eigen::VectorXd& y, const std::vector<int>& runs, Eigen::Index neighbours) {
  Eigen::VectorXd distance(y.size());
  for (const Rows& run : fold_members(runs)) {
    const Eigen::VectorXd own = y(run);
    const Eigen::Index count = std::min(neighbours, own.size());
    for (Eigen::Index i = 0; i < own.size(); ++i) {
      const auto near = own.segment(std::clamp<Eigen::Index>(i - count / 2, 0, own.size() - count), count);
      distance[run[static_cast<std::size_t>(i)]] = own[i] - median_among({near.begin(), near.end()});
    }
  }
  return distance.cwiseAbs();
}

// Inputs in robust scales, so that no single value sets their unit.
Eigen::MatrixXd in_scales(const Eigen::MatrixXd& inputs) {
  Eigen::MatrixXd x = inputs;
  for (Eigen::Index j = 0; j < x.rows(); ++j) {
    const Eigen::VectorXd row = inputs.row(j);
    const double scale = robust_scale(row, ScaleKind::kMad);
    if (scale > 0) x.row(j) /= scale;
  }
  return x;
}

// Distance of each row's target to the median of the rows with the nearest inputs.
Eigen::VectorXd from_inputs(const Eigen::MatrixXd& x, const Eigen::VectorXd& y, Eigen::Index neighbours) {
  const Rows compared = thinned(y.size(), kCompared);
  const Eigen::MatrixXd near = x(Eigen::all, compared);
  const auto count = std::min(static_cast<std::size_t>(neighbours), compared.size());
  std::vector<std::pair<double, std::size_t>> order(compared.size());
  std::vector<double> values(count);
  Eigen::VectorXd distance(y.size());
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    const Eigen::VectorXd squares = (near.colwise() - x.col(i)).colwise().squaredNorm().transpose();
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = {squares[static_cast<Eigen::Index>(k)], k};
    std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count - 1), order.end());
    for (std::size_t k = 0; k < count; ++k) values[k] = y[compared[order[k].second]];
    distance[i] = std::abs(y[i] - median_among(values));
  }
  return distance;
}

// The unit of "far": the scale of the distances; if more than half of them are 0, as with coarse targets, their 80 %
// quantile.
double unit_of(const Eigen::VectorXd& distance) {
  const std::vector<double> values(distance.begin(), distance.end());
  const double scale = kPaperMadToSd * order_statistic(values, 0.5);
  if (scale > 0) return scale;
  const double most = order_statistic(values, 0.8);
  return most > 0 ? most : std::numeric_limits<double>::infinity();
}

}  // namespace

Rows gross_outliers(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& target, const std::vector<int>& runs,
                    double scales) {
  Rows kept = others({}, target.size()), found;
  const Eigen::MatrixXd x = in_scales(inputs);
  for (int pass = 0; pass < kPasses && static_cast<Eigen::Index>(kept.size()) >= kFewest; ++pass) {
    const Eigen::Index neighbours = std::min<Eigen::Index>(kNeighbours, static_cast<Eigen::Index>(kept.size()) / 2);
    const Eigen::VectorXd y = target(kept);
    const Eigen::VectorXd time = from_time(y, taken(runs, kept), neighbours);
    const double time_limit = scales * unit_of(time);
    if ((time.array() <= time_limit).all()) break;  // spares clean records the neighbours
    const Eigen::VectorXd near = from_inputs(x(Eigen::all, kept), y, neighbours);
    const double near_limit = scales * unit_of(near);
    Rows rest;
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      (time[at] > time_limit && near[at] > near_limit ? found : rest).push_back(kept[i]);
    }
    if (rest.size() == kept.size()) break;
    kept = std::move(rest);
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::string rows_text(const Rows& rows) {
  constexpr std::size_t kNamed = 6;  // ranges
  std::string text;
  std::size_t begin = 0;
  for (std::size_t named = 0; begin < rows.size() && named < kNamed; ++named) {
    std::size_t end = begin + 1;
    while (end < rows.size() && rows[end] == rows[end - 1] + 1) ++end;
    text += fmt::format("{}{}", named > 0 ? ", " : "", rows[begin] + 1);
    if (end > begin + 1) text += fmt::format(" to {}", rows[end - 1] + 1);
    begin = end;
  }
  return begin < rows.size() ? fmt::format("{} and {} others", text, rows.size() - begin) : text;
}

}  // namespace prism::training
