// SPDX-License-Identifier: MIT
#include "compensation/training/polynomial.hpp"

#include <fmt/format.h>

#include <Eigen/Householder>
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
    const long double n = static_cast<long double>(n_);  // whose sum is rounded n times
    const long double noise = std::max(1e-17L, 1e-19L * n) * std::fabs(mean_[j]) * std::sqrt(n);
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

Result<PolynomialFit> fit_stepwise(const Eigen::MatrixXd& columns, const Eigen::VectorXd& y,
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
  PolynomialFit model{settings.start, {}, 1, {}};
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
  TermPowers terms(d, std::vector<int>(d, 0));
  for (std::size_t i = 0; i < d; ++i) terms[i][i] = 1;
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

namespace {

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

// The paper's LS and stepwise models (eqs. 21 to 25).
Result<TrainedModel> train_polynomial(TrainingJob job) {
  const TrainingData& data = job.data;
  const TermPowers& terms = job.settings.terms;
  const Eigen::MatrixXd columns = columns_of(data.inputs, terms);
  PolynomialFit fit;
  if (job.settings.method->has(kTerms)) {
    auto found = fit_stepwise(columns, data.target, job.settings.stepwise);
    if (!found) return tl::unexpected<Error>(found.error());
    fit = std::move(*found);
    job.info.kind = "stepwise";
  } else {
    fit.terms.resize(terms.size());
    std::iota(fit.terms.begin(), fit.terms.end(), 0);
    const LinearProblem problem(columns, data.target);
    auto found = problem.fit(fit.terms);
    if (!found) return tl::unexpected<Error>(found.error());
    fit.fit = std::move(*found);
    fit.condition = problem.condition(fit.terms);
    job.info.kind = "polynomial";
  }
  TrainedModel trained;
  std::vector<compensation::Term> model = {{std::vector<int>(data.names.size(), 0), fit.fit.intercept}};
  trained.samples.fitted = Eigen::VectorXd::Constant(data.target.size(), fit.fit.intercept);
  for (std::size_t i = 0; i < fit.terms.size(); ++i) {
    const double coefficient = fit.fit.coefficient[static_cast<Eigen::Index>(i)];
    model.push_back({terms[static_cast<std::size_t>(fit.terms[i])], coefficient});
    trained.samples.fitted += columns.col(fit.terms[i]) * coefficient;
  }
  trained.samples.weight = Eigen::VectorXd::Ones(data.target.size());
  const Eigen::VectorXd left = data.target - trained.samples.fitted;
  const double sd = std::sqrt((data.target.array() - data.target.mean()).square().mean());
  trained.held_out = hold_out(columns, data.target, fit.terms, job.runs);
  job.info.spread = between_run_error_of(trained.held_out, left, sd, job.runs);
  trained.model = std::make_shared<compensation::PolynomialModel>(std::move(job.info), std::move(model), fit.fit.sd());
  trained.polynomial = std::move(fit);
  return trained;
}

}  // namespace prism::training
