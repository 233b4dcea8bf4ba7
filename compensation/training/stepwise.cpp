// SPDX-License-Identifier: MIT
#include "compensation/training/stepwise.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace prism::training {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::vector<int> with(std::vector<int> terms, int term) {
  terms.insert(std::upper_bound(terms.begin(), terms.end(), term), term);
  return terms;
}

std::vector<int> without(std::vector<int> terms, int term) {
  terms.erase(std::find(terms.begin(), terms.end(), term));
  return terms;
}

class StepwiseSearch {
 public:
  StepwiseSearch(const LinearProblem& problem, int count, const StepwiseSettings& settings)
      : problem_(problem), count_(count), settings_(settings), terms_(settings.start) {
    std::sort(terms_.begin(), terms_.end());
  }

  Result<StepwiseResult> run() {
    auto fit = problem_.fit(terms_);
    if (!fit) return tl::unexpected<Error>(fit.error());
    fit_ = std::move(*fit);
    path_.push_back({"initial", -1, 0, 0, {}, {}, terms_});
    const int limit = 100 + 10 * count_;
    for (int step = 0; step < limit; ++step) {
      if (add() || remove()) continue;
      path_.push_back({"stop", -1, 0, 0, candidate_p_, in_model_p(), terms_});
      return StepwiseResult{terms_, fit_, problem_.condition(terms_), path_};
    }
    return make_error(
        "stepwise",
        fmt::format("the terms do not converge after {} steps: increase p-remove or decrease p-enter", limit));
  }

 private:
  bool add() {
    candidate_p_.assign(static_cast<std::size_t>(count_), kNone);
    int best = -1;
    LinearFit best_fit;
    double best_p = settings_.p_enter, best_t = 0;
    for (int term = 0; term < count_; ++term) {
      if (std::binary_search(terms_.begin(), terms_.end(), term)) continue;
      const std::vector<int> trial = with(terms_, term);
      auto fit = problem_.fit(trial);
      if (!fit || fit->df < 1) continue;
      const auto at = std::find(trial.begin(), trial.end(), term) - trial.begin();
      const double p = candidate_p_[static_cast<std::size_t>(term)] = fit->p[at];
      if (!(p < best_p)) continue;
      best = term, best_p = p, best_t = fit->t[at];
      best_fit = std::move(*fit);
    }
    if (best < 0) return false;
    terms_ = with(terms_, best);
    fit_ = std::move(best_fit);
    path_.push_back({"add", best, best_p, best_t, candidate_p_, {}, terms_});
    return true;
  }

  bool remove() {
    if (terms_.empty()) return false;
    Eigen::Index worst = 0;
    const double p = fit_.p.maxCoeff(&worst);
    if (!(p > settings_.p_remove)) return false;
    const int term = terms_[static_cast<std::size_t>(worst)];
    StepwiseStep step{"remove", term, p, fit_.t[worst], candidate_p_, in_model_p(), {}};
    auto fit = problem_.fit(without(terms_, term));
    if (!fit) return false;
    terms_ = without(terms_, term);
    fit_ = std::move(*fit);
    step.terms = terms_;
    path_.push_back(std::move(step));
    return true;
  }

  std::vector<double> in_model_p() const {
    std::vector<double> p(static_cast<std::size_t>(count_), kNone);
    for (std::size_t i = 0; i < terms_.size(); ++i)
      p[static_cast<std::size_t>(terms_[i])] = fit_.p[static_cast<Eigen::Index>(i)];
    return p;
  }

  const LinearProblem& problem_;
  int count_;
  const StepwiseSettings& settings_;
  std::vector<int> terms_;
  LinearFit fit_;
  std::vector<double> candidate_p_;
  std::vector<StepwiseStep> path_;
};

}  // namespace

Result<StepwiseResult> fit_stepwise(const Eigen::MatrixXd& columns, const Eigen::VectorXd& y,
                                    const StepwiseSettings& settings) {
  if (!(settings.p_enter > 0 && settings.p_enter <= settings.p_remove && settings.p_remove <= 1)) {
    return make_error("stepwise", fmt::format("found p-enter {} and p-remove {}, expected 0 < p-enter <= p-remove <= 1",
                                              settings.p_enter, settings.p_remove));
  }
  if (columns.rows() < 3)
    return make_error("stepwise", fmt::format("found {} samples, expected at least 3", columns.rows()));
  const LinearProblem problem(columns, y);
  return StepwiseSearch(problem, static_cast<int>(columns.cols()), settings).run();
}

}  // namespace prism::training
