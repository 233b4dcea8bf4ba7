// SPDX-License-Identifier: MIT
#include "compensation/training/polynomial.hpp"

#include <fmt/format.h>

#include <Eigen/Householder>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "compensation/polynomial_model.hpp"
#include "compensation/training/trainer.hpp"

namespace prism::training {
namespace {

// A smaller pivot of a column of length 1 is rounding: the column is a combination of the others.
constexpr long double kDependent = 1e-10L;

double two_sided_p(double t, int df) {
  if (!std::isfinite(t)) return 0;
  using Plain = boost::math::policies::policy<boost::math::policies::promote_double<false>>;
  const boost::math::students_t_distribution<double, Plain> distribution(df);
  return 2 * boost::math::cdf(boost::math::complement(distribution, std::fabs(t)));
}

// R of the QR of `a`, column by column: only the number of rows is large, and Eigen's blocked QR in long double takes
// as long to compile as half of this module.
template <typename Matrix>
Matrix triangle_of(Matrix a) {
  const Eigen::Index size = std::min(a.rows(), a.cols());
  Matrix work(a.cols(), 1);
  for (Eigen::Index j = 0; j < size; ++j) {
    typename Matrix::Scalar tau, diagonal;
    auto rest = a.col(j).tail(a.rows() - j);
    rest.makeHouseholderInPlace(tau, diagonal);
    a(j, j) = diagonal;
    a.bottomRightCorner(a.rows() - j, a.cols() - j - 1)
        .applyHouseholderOnTheLeft(a.col(j).tail(a.rows() - j - 1), tau, work.data());
  }
  Matrix r = Matrix::Zero(a.cols(), a.cols());
  for (Eigen::Index j = 0; j < a.cols(); ++j)
    r.col(j).head(std::min(j + 1, size)) = a.col(j).head(std::min(j + 1, size));
  return r;
}

}  // namespace

double LinearFit::sd() const { return df > 0 ? std::sqrt(sse / df) : 0; }

LinearProblem::LinearProblem(const Eigen::MatrixXd& columns, const Eigen::VectorXd& y) : n_(y.size()) {
  const Eigen::Index m = columns.cols();
  Matrix all(n_, m + 1);
  all << columns.cast<long double>(), y.cast<long double>();
  mean_ = all.colwise().mean().transpose();
  all.rowwise() -= mean_.transpose();
  scale_ = all.colwise().norm().transpose();
  for (Eigen::Index j = 0; j <= m; ++j) {
    const long double noise = 1e-17L * std::fabs(mean_[j]) * std::sqrt(static_cast<long double>(n_));
    if (!(scale_[j] > noise)) scale_[j] = 0;
    all.col(j) *= scale_[j] > 0 ? 1 / scale_[j] : 0;
  }
  triangle_ = triangle_of(std::move(all));
}

Result<LinearFit> LinearProblem::fit(const std::vector<int>& subset) const {
  const auto m = static_cast<Eigen::Index>(subset.size());
  LinearFit fit;
  fit.df = static_cast<int>(n_ - 1 - m);
  if (fit.df < 0)
    return make_error("least squares", fmt::format("found {} samples, expected more than {} terms", n_, m));
  const Vector y = triangle_.rightCols(1);
  if (m == 0) {
    fit.intercept = static_cast<double>(mean_[mean_.size() - 1]);
    fit.sse = static_cast<double>(y.squaredNorm() * scale_.tail(1)[0] * scale_.tail(1)[0]);
    return fit;
  }
  Matrix stacked(triangle_.rows(), m + 1);
  stacked << triangle_(Eigen::all, subset), y;
  const Matrix r = triangle_of(std::move(stacked));
  for (Eigen::Index j = 0; j < m; ++j) {
    if (!(std::fabs(r(j, j)) > kDependent))
      return make_error("least squares",
                        fmt::format("term {} depends on the others", subset[static_cast<std::size_t>(j)] + 1));
  }
  const auto upper = r.topLeftCorner(m, m).template triangularView<Eigen::Upper>();
  const Vector beta = upper.solve(r.col(m).head(m));
  const long double y_scale = scale_.tail(1)[0];
  const long double sse = r(m, m) * r(m, m) * y_scale * y_scale;
  Matrix inverse(m, m);
  for (Eigen::Index j = 0; j < m; ++j) inverse.col(j) = upper.solve(Vector::Unit(m, j));
  const long double variance = fit.df > 0 ? sse / fit.df : 0;
  fit.sse = static_cast<double>(sse);
  fit.coefficient.resize(m);
  fit.t.resize(m);
  fit.p.resize(m);
  long double intercept = mean_[mean_.size() - 1];
  for (Eigen::Index j = 0; j < m; ++j) {
    const int column = subset[static_cast<std::size_t>(j)];
    const long double coefficient = beta[j] * y_scale / scale_[column];
    const long double error = std::sqrt(variance) * inverse.row(j).norm() / scale_[column];
    intercept -= coefficient * mean_[column];
    fit.coefficient[j] = static_cast<double>(coefficient);
    fit.t[j] = static_cast<double>(coefficient / error);
    fit.p[j] = fit.df > 0 ? two_sided_p(fit.t[j], fit.df) : 1;
  }
  fit.intercept = static_cast<double>(intercept);
  return fit;
}

// XᵀX of the raw columns from the triangle and the means: [N, N m; N m, RᵀR scaled + N m mᵀ], scaled to length 1. Its
// eigenvalues would be squares, so this decomposes the stacked form [√N, √N m; 0, R scale] instead.
double LinearProblem::condition(const std::vector<int>& subset) const {
  const auto m = static_cast<Eigen::Index>(subset.size());
  Matrix x = Matrix::Zero(triangle_.rows() + 1, m + 1);
  const long double root = std::sqrt(static_cast<long double>(n_));
  x(0, 0) = root;
  for (Eigen::Index j = 0; j < m; ++j) {
    const int column = subset[static_cast<std::size_t>(j)];
    x(0, j + 1) = root * mean_[column];
    x.col(j + 1).tail(triangle_.rows()) = triangle_.col(column) * scale_[column];
  }
  x.colwise().normalize();
  const Eigen::MatrixXd r = triangle_of(std::move(x)).cast<double>();
  const Eigen::VectorXd singular = Eigen::JacobiSVD<Eigen::MatrixXd, Eigen::NoQRPreconditioner>(r).singularValues();
  return singular[0] / singular[singular.size() - 1];
}

Result<StepwiseResult> fit_stepwise(const Eigen::MatrixXd& columns, const Eigen::VectorXd& y,
                                    const StepwiseSettings& settings) {
  if (!(settings.p_enter > 0 && settings.p_enter <= settings.p_remove && settings.p_remove <= 1)) {
    return make_error("stepwise", fmt::format("found p-enter {} and p-remove {}, expected 0 < p-enter <= p-remove <= 1",
                                              settings.p_enter, settings.p_remove));
  }
  if (columns.rows() < 3)
    return make_error("stepwise", fmt::format("found {} samples, expected at least 3", columns.rows()));
  const LinearProblem problem(columns, y);
  const int count = static_cast<int>(columns.cols()), limit = 100 + 10 * count;
  const std::vector<double> none(static_cast<std::size_t>(count), std::numeric_limits<double>::quiet_NaN());
  StepwiseResult model{settings.start, {}, 1, {}};
  std::sort(model.terms.begin(), model.terms.end());
  const auto take = [&](LinearFit fit, StepwiseStep step) {
    model.fit = std::move(fit);
    model.terms = step.terms;
    model.path.push_back(std::move(step));
  };
  auto first = problem.fit(model.terms);
  if (!first) return tl::unexpected<Error>(first.error());
  take(std::move(*first), {"initial", -1, 0, 0, {}, {}, model.terms});
  for (int step = 0; step < limit; ++step) {
    StepwiseStep add{"add", -1, settings.p_enter, 0, none, {}, {}};
    LinearFit best;
    for (int term = 0; term < count; ++term) {
      if (std::binary_search(model.terms.begin(), model.terms.end(), term)) continue;
      std::vector<int> trial = model.terms;
      const auto at = std::upper_bound(trial.begin(), trial.end(), term) - trial.begin();
      trial.insert(trial.begin() + at, term);
      auto fit = problem.fit(trial);
      if (!fit || fit->df < 1) continue;
      const double p = add.candidate_p[static_cast<std::size_t>(term)] = fit->p[at];
      if (!(p < add.p)) continue;
      add.term = term, add.p = p, add.t = fit->t[at], add.terms = std::move(trial);
      best = std::move(*fit);
    }
    if (add.term >= 0) {
      take(std::move(best), std::move(add));
      continue;
    }
    StepwiseStep stop{"stop", -1, 0, 0, std::move(add.candidate_p), none, model.terms};
    for (std::size_t i = 0; i < model.terms.size(); ++i)
      stop.in_model_p[static_cast<std::size_t>(model.terms[i])] = model.fit.p[static_cast<Eigen::Index>(i)];
    Eigen::Index worst = 0;
    if (!model.terms.empty() && model.fit.p.maxCoeff(&worst) > settings.p_remove) {
      StepwiseStep remove = stop;
      remove.terms.erase(remove.terms.begin() + worst);
      if (auto fit = problem.fit(remove.terms)) {
        remove.action = "remove", remove.term = model.terms[static_cast<std::size_t>(worst)];
        remove.p = model.fit.p[worst], remove.t = model.fit.t[worst];
        take(std::move(*fit), std::move(remove));
        continue;
      }
    }
    model.path.push_back(std::move(stop));
    model.condition = problem.condition(model.terms);
    return model;
  }
  return make_error(
      "stepwise",
      fmt::format("the terms do not converge after {} steps: increase p-remove or decrease p-enter", limit));
}

TermPowers cubic_terms() { return {{1}, {2}, {3}}; }

TermPowers plain_terms(std::size_t d) {
  TermPowers terms;
  for (std::size_t i = 0; i < d; ++i) {
    terms.emplace_back(d, 0);
    terms.back()[i] = 1;
  }
  return terms;
}

TermPowers second_order_terms(std::size_t d) {
  TermPowers terms;
  const auto add = [&](std::size_t i, std::size_t j) {
    terms.emplace_back(d, 0);
    ++terms.back()[i];
    if (j < d) ++terms.back()[j];
  };
  for (std::size_t i = 0; i < d; ++i) add(i, d), add(i, i);
  for (std::size_t i = 0; i < d; ++i) {
    for (std::size_t j = i + 1; j < d; ++j) add(i, j);
  }
  return terms;
}

std::string term_name(const std::vector<int>& powers, const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < powers.size(); ++i) {
    if (powers[i] == 0) continue;
    text += (text.empty() ? "" : "*") + names[i];
    if (powers[i] > 1) text += fmt::format("^{}", powers[i]);
  }
  return text.empty() ? "intercept" : text;
}

namespace {

// One column per term, from inputs d × N.
Eigen::MatrixXd columns_of(const Eigen::MatrixXd& inputs, const TermPowers& terms) {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Ones(inputs.cols(), static_cast<Eigen::Index>(terms.size()));
  for (std::size_t j = 0; j < terms.size(); ++j) {
    for (std::size_t i = 0; i < terms[j].size(); ++i) {
      for (int power = 0; power < terms[j][i]; ++power)
        columns.col(static_cast<Eigen::Index>(j)).array() *=
            inputs.row(static_cast<Eigen::Index>(i)).transpose().array();
    }
  }
  return columns;
}

// The chosen terms, fitted again without each fold.
HeldOutErrors hold_out(const Eigen::MatrixXd& columns, const Eigen::VectorXd& y, const std::vector<int>& chosen,
                       const std::vector<int>& runs) {
  return held_out_errors(others({}, y.size()), runs, 1, [&](const Rows& rest, const Rows& members) -> Eigen::VectorXd {
    const auto fit = LinearProblem(columns(rest, Eigen::all), y(rest)).fit(chosen);
    if (!fit) return {};  // only the held-out block changed one of the inputs
    Eigen::VectorXd error = y(members).array() - fit->intercept;
    for (std::size_t j = 0; j < chosen.size(); ++j)
      error -= columns(members, chosen[j]) * fit->coefficient[static_cast<Eigen::Index>(j)];
    return error;
  });
}

}  // namespace

ResourcePlan plan_polynomial(Eigen::Index samples, Eigen::Index, const TrainingSettings& settings) {
  return {static_cast<double>(samples) * 16 * static_cast<double>(settings.terms.size() + 2) * 2};
}

// The paper's LS and stepwise models (eqs. 21 to 25).
Result<TrainedModel> train_polynomial(TrainingJob job) {
  const TrainingData& data = job.data;
  const TermPowers& terms = job.settings.terms;
  for (const auto& powers : terms) {
    if (powers.size() != data.names.size())
      return make_error("terms", fmt::format("found {} powers, expected {}", powers.size(), data.names.size()));
  }
  const Eigen::MatrixXd columns = columns_of(data.inputs, terms);
  TrainedModel trained;
  std::vector<int> chosen(terms.size());
  std::iota(chosen.begin(), chosen.end(), 0);
  if (job.settings.method->has(kTerms)) {
    auto result = fit_stepwise(columns, data.target, job.settings.stepwise);
    if (!result) return tl::unexpected<Error>(result.error());
    chosen = result->terms;
    trained.linear = result->fit;
    trained.condition = result->condition;
    trained.stepwise = std::move(*result);
    job.info.kind = "stepwise";
  } else {
    const LinearProblem problem(columns, data.target);
    auto fit = problem.fit(chosen);
    if (!fit) return tl::unexpected<Error>(fit.error());
    trained.linear = std::move(*fit);
    trained.condition = problem.condition(chosen);
    job.info.kind = "polynomial";
  }
  std::vector<compensation::Term> model = {{std::vector<int>(data.names.size(), 0), trained.linear->intercept}};
  trained.samples.fitted = Eigen::VectorXd::Constant(data.target.size(), trained.linear->intercept);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const double coefficient = trained.linear->coefficient[static_cast<Eigen::Index>(i)];
    model.push_back({terms[static_cast<std::size_t>(chosen[i])], coefficient});
    trained.samples.fitted += columns.col(chosen[i]) * coefficient;
  }
  trained.samples.weight = Eigen::VectorXd::Ones(data.target.size());
  const Eigen::VectorXd left = data.target - trained.samples.fitted;
  const double sd = std::sqrt((data.target.array() - data.target.mean()).square().mean());
  trained.held_out = hold_out(columns, data.target, chosen, job.runs);
  job.info.spread = between_run_error_of(trained.held_out, left, sd, job.runs);
  trained.model =
      std::make_shared<compensation::PolynomialModel>(std::move(job.info), std::move(model), trained.linear->sd());
  return trained;
}

namespace {

/// Inputs in standard deviations, with a row of zeros for each that is constant.
Eigen::MatrixXd in_deviations(const Eigen::MatrixXd& inputs, std::vector<bool>& moves) {
  Eigen::MatrixXd scaled = inputs.transpose();
  for (Eigen::Index i = 0; i < scaled.cols(); ++i) {
    const double mean = scaled.col(i).mean();
    scaled.col(i).array() -= mean;
    const double sd = std::sqrt(scaled.col(i).squaredNorm() / static_cast<double>(scaled.rows()));
    moves.push_back(sd > 1e-9 * (1 + std::abs(mean)));
    if (moves.back()) scaled.col(i) /= sd;
  }
  return scaled.transpose();
}

}  // namespace

Result<InputSearch> search_inputs(const TrainingData& data) {
  constexpr Eigen::Index kFewestToChoose = 40;
  constexpr int kHeldOutParts = 10;
  constexpr std::size_t kMost = 6;
  if (data.target.size() < kFewestToChoose)
    return make_error("inputs", fmt::format("found {} samples, expected at least {} to choose inputs by",
                                            data.target.size(), kFewestToChoose));
  std::vector<bool> moves;
  const Eigen::MatrixXd inputs = in_deviations(data.inputs, moves);
  const Folds parts = blocked_folds(runs_of(data), kHeldOutParts);
  const auto judge = [&](const std::vector<int>& chosen) {
    TermPowers terms = second_order_terms(chosen.size());
    terms.insert(terms.begin(), std::vector<int>(chosen.size(), 0));  // the intercept
    const Eigen::MatrixXd columns = columns_of(inputs(chosen, Eigen::all), terms);
    const Eigen::VectorXd error = held_out(parts, [&](const Rows& rest, const Rows& part) -> Eigen::VectorXd {
      const Eigen::VectorXd fit = columns(rest, Eigen::all).colPivHouseholderQr().solve(data.target(rest));
      return data.target(part) - columns(part, Eigen::all) * fit;
    });
    double squares = 0, scatter = 0;
    std::vector<double> means;
    for (const Rows& part : fold_members(parts)) {
      const double own = error(part).squaredNorm();
      squares += own;
      means.push_back(own / static_cast<double>(part.size()));
    }
    const double mean = squares / static_cast<double>(error.size()), count = static_cast<double>(means.size());
    for (const double own : means) scatter += (own - mean) * (own - mean);
    InputSet set;
    for (const int i : chosen) set.inputs.push_back(data.names[static_cast<std::size_t>(i)]);
    set.error_deg_per_h = std::sqrt(mean);
    if (mean > 0 && count > 1)
      set.standard_error_deg_per_h = std::sqrt(scatter / (count - 1) / count) / (2 * set.error_deg_per_h);
    return set;
  };
  const auto better = [](const InputSet& a, const InputSet& b) { return a.error_deg_per_h < b.error_deg_per_h; };
  InputSearch search;
  search.without_deg_per_h = judge({}).error_deg_per_h;
  std::vector<int> left, chosen;
  for (std::size_t i = 0; i < moves.size(); ++i) {
    if (!moves[i]) continue;
    left.push_back(static_cast<int>(i));
    search.alone.push_back(judge({left.back()}));
  }
  if (left.empty()) return make_error("inputs", "found only constant inputs, expected one that changes");
  while (!left.empty() && chosen.size() < kMost) {
    std::vector<InputSet> sets;
    chosen.push_back(-1);
    for (const int candidate : left) {
      chosen.back() = candidate;
      sets.push_back(judge(chosen));
    }
    const auto best = std::min_element(sets.begin(), sets.end(), better);
    const auto which = left.begin() + (best - sets.begin());
    chosen.back() = *which;
    left.erase(which);
    search.path.push_back(std::move(*best));
  }
  const auto best = std::min_element(search.path.begin(), search.path.end(), better);
  const double enough = best->error_deg_per_h + best->standard_error_deg_per_h;
  while (search.path[search.chosen].error_deg_per_h > enough) ++search.chosen;
  return search;
}

}  // namespace prism::training
