// SPDX-License-Identifier: MIT
// The paper's LS and stepwise models (eqs. 21 to 25).
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "compensation/polynomial_model.hpp"
#include "compensation/training/between_run_error.hpp"
#include "compensation/training/methods.hpp"

namespace prism::training {
namespace {

Eigen::MatrixXd columns_of(const TrainingData& data, const TermPowers& terms) {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Ones(data.target.size(), static_cast<Eigen::Index>(terms.size()));
  for (std::size_t j = 0; j < terms.size(); ++j) {
    for (std::size_t i = 0; i < terms[j].size(); ++i) {
      for (int power = 0; power < terms[j][i]; ++power) {
        columns.col(static_cast<Eigen::Index>(j)).array() *=
            data.inputs.row(static_cast<Eigen::Index>(i)).transpose().array();
      }
    }
  }
  return columns;
}

// The chosen terms, fitted again without each fold.
HeldOutErrors hold_out(const Eigen::MatrixXd& columns, const Eigen::VectorXd& y, const std::vector<int>& chosen,
                       const std::vector<int>& runs) {
  HeldOutErrors held{y, Eigen::VectorXd::Zero(y.size()), held_out_folds(runs), others({}, y.size())};
  for (const auto& members : fold_members(held.folds)) {
    const std::vector<Eigen::Index> rest = others(members, y.size());
    const auto fit = LinearProblem(columns(rest, Eigen::all), y(rest)).fit(chosen);
    if (!fit) return {};  // only the held-out block changed one of the inputs
    held.error(members).array() -= fit->intercept;
    for (std::size_t j = 0; j < chosen.size(); ++j)
      held.error(members) -= columns(members, chosen[j]) * fit->coefficient[static_cast<Eigen::Index>(j)];
  }
  return held;
}

std::vector<compensation::Term> terms_of(const TermPowers& powers, const std::vector<int>& chosen, const LinearFit& fit,
                                         std::size_t inputs) {
  std::vector<compensation::Term> terms = {{std::vector<int>(inputs, 0), fit.intercept}};
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    terms.push_back({powers[static_cast<std::size_t>(chosen[i])], fit.coefficient[static_cast<Eigen::Index>(i)]});
  }
  return terms;
}

}  // namespace

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

Result<ResourcePlan> plan_polynomial(Eigen::Index samples, Eigen::Index, const TrainingSettings& settings) {
  ResourcePlan plan;
  plan.bytes = static_cast<double>(samples) * 16 * static_cast<double>(settings.terms.size() + 2) * 2;
  return plan;
}

Result<TrainedModel> train_polynomial(TrainingJob job) {
  const TrainingData& data = job.data;
  const TrainingSettings& settings = job.settings;
  if (!data.inputs.allFinite() || !data.target.allFinite())
    return make_error("training data", "found a number that is not finite");
  for (const auto& powers : settings.terms) {
    if (powers.size() != data.names.size())
      return make_error("terms", fmt::format("found {} powers, expected {}", powers.size(), data.names.size()));
  }
  const Eigen::MatrixXd columns = columns_of(data, settings.terms);
  TrainedModel trained;
  std::vector<int> chosen(settings.terms.size());
  std::iota(chosen.begin(), chosen.end(), 0);
  if (settings.method->has(kTerms)) {
    auto result = fit_stepwise(columns, data.target, settings.stepwise);
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
  trained.samples.fitted = Eigen::VectorXd::Constant(data.target.size(), trained.linear->intercept);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    trained.samples.fitted += columns.col(chosen[i]) * trained.linear->coefficient[static_cast<Eigen::Index>(i)];
  }
  trained.samples.weight = Eigen::VectorXd::Ones(data.target.size());
  const std::size_t inputs = data.names.size();
  const Eigen::VectorXd left = data.target - trained.samples.fitted;
  const double sd = std::sqrt((data.target.array() - data.target.mean()).square().mean());
  trained.held_out = hold_out(columns, data.target, chosen, job.runs);
  job.info.spread = between_run_error_of(trained.held_out, left, sd, job.runs);
  trained.model = std::make_shared<compensation::PolynomialModel>(
      std::move(job.info), terms_of(settings.terms, chosen, *trained.linear, inputs), trained.linear->sd());
  return trained;
}

}  // namespace

extern const Method kLeastSquares, kStepwise;
const Method kLeastSquares = {"ls", "", kCubic, plan_polynomial, train_polynomial, describe_polynomial};
const Method kStepwise = {"stepwise", "", kTerms, plan_polynomial, train_polynomial, describe_polynomial};

namespace {

std::string named(const TrainingSettings& settings, int term, const std::vector<std::string>& names) {
  return term_name(settings.terms[static_cast<std::size_t>(term)], names);
}

nlohmann::ordered_json coefficients_json(const TrainedModel& trained, const std::vector<std::string>& names) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const compensation::Term& term : static_cast<const compensation::PolynomialModel&>(*trained.model).terms())
    json[term_name(term.powers, names)] = term.coefficient;
  return json;
}

nlohmann::ordered_json p_values(const std::vector<double>& p, const TrainingSettings& settings,
                                const std::vector<std::string>& names) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (std::isfinite(p[i])) json[named(settings, static_cast<int>(i), names)] = p[i];
  }
  return json;
}

nlohmann::ordered_json path_json(const StepwiseResult& result, const TrainingSettings& settings,
                                 const std::vector<std::string>& names) {
  nlohmann::ordered_json path = nlohmann::ordered_json::array();
  for (const StepwiseStep& step : result.path) {
    nlohmann::ordered_json entry = {{"action", step.action}};
    if (step.term >= 0)
      entry.update({{"term", named(settings, step.term, names)},
                    {"p", finite_json(step.p)},
                    {"t", finite_json(step.t)},
                    {"F", finite_json(step.t * step.t)}});
    if (!step.candidate_p.empty()) entry["candidate_p"] = p_values(step.candidate_p, settings, names);
    if (!step.in_model_p.empty()) entry["in_model_p"] = p_values(step.in_model_p, settings, names);
    entry["terms"] = nlohmann::ordered_json::array();
    for (const int term : step.terms) entry["terms"].push_back(named(settings, term, names));
    path.push_back(std::move(entry));
  }
  return path;
}

std::string lines_of(const TrainedModel& trained, const TrainingSettings& settings,
                     const std::vector<std::string>& names) {
  std::string text =
      detail_line("coefficients", target_unit(trained) + " over the units of the term" +
                                      (trained.model->info().table ? "" : " (T degC, dTdt degC/s, U V)"));
  for (const compensation::Term& term : static_cast<const compensation::PolynomialModel&>(*trained.model).terms())
    text += detail_line("", fmt::format("{:<10} {: .6g}", term_name(term.powers, names), term.coefficient));
  if (trained.stepwise) {
    text += detail_line("steps", "p: probability that a term without effect improves the fit so much");
    for (const StepwiseStep& step : trained.stepwise->path) {
      if (step.term >= 0)
        text += detail_line(
            "", fmt::format("{:<7} {:<10} p {:.2g}", step.action, named(settings, step.term, names), step.p));
    }
  }
  text += detail_line("residual", plain_number(trained.linear->sd(), 3) + " " + target_unit(trained) +
                                      ": 1 sigma that the model leaves in its own recording");
  return text +
         detail_line("condition", fmt::format("{:.3g}: above 1e8 the terms are almost the same", trained.condition));
}

}  // namespace

MethodSummary describe_polynomial(const TrainedModel& trained, const TrainingSettings& settings,
                                  const std::vector<std::string>& names) {
  nlohmann::ordered_json json;
  json["coefficients"] = coefficients_json(trained, names);
  json["sse"] = trained.linear->sse;
  json["df"] = trained.linear->df;
  json["sd"] = trained.linear->sd();
  json["condition"] = finite_json(trained.condition);
  if (trained.stepwise) json["path"] = path_json(*trained.stepwise, settings, names);
  return {std::move(json), lines_of(trained, settings, names)};
}

}  // namespace prism::training
