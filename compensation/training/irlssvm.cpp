// SPDX-License-Identifier: MIT
#include "compensation/training/irlssvm.hpp"

#include <fmt/format.h>

#include <numeric>
#include <optional>

namespace prism::training {
namespace {

struct Solve {
  LssvmSolution solution;
  Eigen::VectorXd residual;
  std::vector<Eigen::Index> kept;
  LssvmFactor factor;
};

// A weight of zero makes 1/(c v) infinite: the sample is removed from the system, alpha = 0 (eq. 16 in eq. 14).
Result<Solve> solve_weighted(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c,
                             const Eigen::VectorXd& weight, const ExtendedMatrix* extended) {
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    if (weight[i] > 0) kept.push_back(i);
  }
  if (kept.size() < 2)
    return make_error("IR-LSSVM",
                      fmt::format("{} of {} samples have a weight, expected at least 2", kept.size(), y.size()));
  const bool all = static_cast<Eigen::Index>(kept.size()) == y.size();
  const Eigen::VectorXd inverse_cv = 1 / (c * weight(kept).array());
  auto factor =
      all ? LssvmFactor::make(kernel, inverse_cv, y) : LssvmFactor::make(kernel(kept, kept), inverse_cv, y(kept));
  if (!factor) return tl::unexpected<Error>(factor.error());
  LssvmSolution solution = factor->solution();
  if (extended) {
    all ? refine(*extended, inverse_cv, y, *factor, solution)
        : refine((*extended)(kept, kept), inverse_cv, y(kept), *factor, solution);
  }
  Eigen::VectorXd residual = solution.alpha.cwiseProduct(inverse_cv);
  if (!all) {
    const Eigen::VectorXd alpha = solution.alpha;
    solution.alpha = Eigen::VectorXd::Zero(y.size());
    solution.alpha(kept) = alpha;
    const Eigen::VectorXd inside = residual;
    residual = y - kernel * solution.alpha;
    residual.array() -= solution.b;
    residual(kept) = inside;
  }
  return Solve{std::move(solution), std::move(residual), std::move(kept), std::move(*factor)};
}

// Alternation between two states: successive solutions differ, but every second one is the same.
bool alternates(const Eigen::VectorXd& now, const Eigen::VectorXd& last, const Eigen::VectorXd& before, int solves) {
  constexpr int kPatience = 20;
  if (solves < kPatience || before.size() == 0) return false;
  return (now - before).norm() < 1e-3 * (now - last).norm();
}

// A change below the rounding limit that no longer decreases is noise.
bool at_fixed_point(const std::vector<double>& change, double tolerance, double floor) {
  const double last = change.back();
  if (last <= tolerance) return true;
  return last <= floor && change.size() > 1 && last > 0.8 * change[change.size() - 2];
}

}  // namespace

double rounding_floor(double c, const Eigen::VectorXd& alpha) {
  constexpr double kRounding = 2e-16;
  return kRounding * c * static_cast<double>(alpha.size()) * alpha.norm();
}

Result<IrlssvmFit> fit_irlssvm(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c,
                               const ReweightSettings& settings, const Eigen::VectorXd* start) {
  Eigen::VectorXd weight = start ? *start : Eigen::VectorXd::Ones(y.size());
  std::optional<Solve> solved;
  Eigen::VectorXd alpha, last, before;  // of this solve and of the two before it
  const auto solve = [&](const Eigen::VectorXd& v) -> Result<Eigen::VectorXd> {
    auto next = solve_weighted(kernel, y, c, v, settings.extended);
    if (!next) return tl::unexpected<Error>(next.error());
    before = std::move(last);
    last = std::move(alpha);
    alpha = next->solution.alpha;
    solved.emplace(std::move(*next));
    return solved->residual;
  };
  const auto rule = [&](const ReweightStep&, ReweightReport& report) {
    report.change.push_back((alpha - last).norm());
    const bool averaged = report.oscillating;
    if (settings.tolerance > 0 && alternates(alpha, last, before, report.solves)) report.oscillating = true;
    if (at_fixed_point(report.change, settings.tolerance, rounding_floor(c, alpha))) return AfterStep::kConverged;
    return averaged ? AfterStep::kStop : AfterStep::kContinue;
  };
  auto report = reweight(settings, weight, solve, rule);
  if (!report) return tl::unexpected<Error>(report.error());
  return IrlssvmFit{std::move(solved->solution), std::move(weight),         std::move(solved->residual),
                    std::move(solved->kept),     std::move(solved->factor), std::move(*report)};
}

void refine_fit(const ExtendedMatrix& kernel, double c, const Eigen::VectorXd& y, IrlssvmFit& fit) {
  const Eigen::VectorXd inverse_cv = 1 / (c * fit.weight(fit.kept).array());
  LssvmSolution kept{fit.solution.alpha(fit.kept), fit.solution.b};
  refine(kernel(fit.kept, fit.kept), inverse_cv, y(fit.kept), fit.factor, kept);
  fit.solution.alpha(fit.kept) = kept.alpha;
  fit.solution.b = kept.b;
  fit.residual(fit.kept) = kept.alpha.cwiseProduct(inverse_cv);
}

CrossValidation fold_costs(const Eigen::VectorXd& residual, const Folds& folds, double scale) {
  CrossValidation cv;
  cv.residual = residual * scale;
  for (const auto& fold : fold_members(folds)) {
    const Eigen::VectorXd held_out = cv.residual(fold);
    cv.fold_mse.push_back(held_out.squaredNorm() / static_cast<double>(held_out.size()));
    cv.fold_mae.push_back(held_out.cwiseAbs().mean());
  }
  const double n = static_cast<double>(cv.fold_mse.size());
  cv.mse = std::accumulate(cv.fold_mse.begin(), cv.fold_mse.end(), 0.0) / n;
  cv.mae = std::accumulate(cv.fold_mae.begin(), cv.fold_mae.end(), 0.0) / n;
  return cv;
}

Result<CrossValidation> cross_validate(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c,
                                       const Folds& folds, double scale) {
  const auto factor = LssvmFactor::make(kernel, Eigen::VectorXd::Constant(y.size(), 1 / c), y);
  if (!factor) return tl::unexpected<Error>(factor.error());
  return fold_costs(factor->leave_fold_out(folds), folds, scale);
}

Result<CrossValidation> leave_one_out(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c, double scale) {
  const auto factor = LssvmFactor::make(kernel, Eigen::VectorXd::Constant(y.size(), 1 / c), y);
  if (!factor) return tl::unexpected<Error>(factor.error());
  CrossValidation cv;
  cv.residual = factor->leave_one_out() * scale;
  cv.mse = cv.residual.squaredNorm() / static_cast<double>(y.size());
  cv.mae = cv.residual.cwiseAbs().mean();
  return cv;
}

Result<CrossValidation> cross_validate_robust(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c,
                                              const ReweightSettings& settings, const Folds& folds, double scale) {
  Eigen::VectorXd residual(y.size());
  std::vector<int> solves;
  const auto members = fold_members(folds);
  for (std::size_t f = 0; f < members.size(); ++f) {
    std::vector<Eigen::Index> training;
    for (std::size_t i = 0; i < folds.size(); ++i) {
      if (folds[i] != static_cast<int>(f)) training.push_back(static_cast<Eigen::Index>(i));
    }
    ReweightSettings inside = settings;
    ExtendedMatrix extended;
    if (settings.extended) {
      extended = (*settings.extended)(training, training);
      inside.extended = &extended;
    }
    const auto fit = fit_irlssvm(kernel(training, training), y(training), c, inside);
    if (!fit) return tl::unexpected<Error>(fit.error());
    const Eigen::MatrixXd across = kernel(training, members[f]);
    residual(members[f]) = y(members[f]) - across.transpose() * fit->solution.alpha -
                           Eigen::VectorXd::Constant(across.cols(), fit->solution.b);
    solves.push_back(fit->report.solves);
  }
  CrossValidation cv = fold_costs(residual, folds, scale);
  cv.fold_solves = std::move(solves);
  return cv;
}

}  // namespace prism::training
