// SPDX-License-Identifier: MIT
#include "compensation/lssvm_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/json_table.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/kernel.hpp"
#include "compensation/model.hpp"
#include "compensation/model_text.hpp"

namespace prism::compensation {
namespace {

std::string canonical(const LssvmParameters& p) {
  std::string text =
      fmt::format("{} {}\n{} {}\n", exact_texts(std::vector{p.c, p.sigma2, p.b, p.linear_b}), exact_numbers(p.linear),
                  exact_numbers(p.normalisation.input_shift), exact_numbers(p.normalisation.input_scale));
  text += exact_texts(std::vector{p.normalisation.target_shift, p.normalisation.target_scale}) + '\n';
  text += exact_numbers(p.centres) + '\n' + exact_numbers(p.alpha) + '\n' + exact_numbers(p.weight) + '\n';
  if (const auto& u = p.uncertainty) {
    text += exact_texts(std::vector{u->prior_variance, u->sd_scale, u->guard_fraction}) + ' ' + exact_numbers(u->gram);
  }
  return text;
}

std::string wrong_shape(const ModelInfo& info, const LssvmParameters& p) {
  const Eigen::Index d = static_cast<Eigen::Index>(info.inputs.size()), n = p.centres.cols();
  if (std::string wrong = wrong_centres(info, p.normalisation, p.centres, p.alpha.size()); !wrong.empty()) return wrong;
  if (p.weight.size() != 0 && p.weight.size() != n)
    return fmt::format("found {} weights, expected {}", p.weight.size(), n);
  if (p.linear.size() != 0 && p.linear.size() != d)
    return fmt::format("found {} linear coefficients, expected {}", p.linear.size(), d);
  if (!p.uncertainty) return {};
  const Eigen::Index gram = p.uncertainty->gram.rows();
  if (gram != 0 && (gram != n + 1 || p.uncertainty->gram.cols() != n + 1))
    return fmt::format("gram has {} rows, expected {}", gram, n + 1);
  if (gram == 0 && p.weight.size() == 0) return fmt::format("found no weights, expected {}", n);
  return {};
}

}  // namespace

LssvmModel::LssvmModel(ModelInfo info, LssvmParameters parameters)
    : Model(std::move(info), canonical(parameters)),
      parameters_(std::move(parameters)),
      centres_(parameters_.centres, parameters_.sigma2) {}

Result<ModelPtr> LssvmModel::make(ModelInfo info, LssvmParameters parameters) {
  const std::string where = info.name.empty() ? info.kind : info.name;
  if (std::string wrong = wrong_shape(info, parameters); !wrong.empty()) return make_error(where, std::move(wrong));
  std::shared_ptr<LssvmModel> model(new LssvmModel(std::move(info), std::move(parameters)));
  if (model->parameters_.uncertainty && !model->factorise()) {
    return make_error(
        where, "the kernel matrix of the centres is not positive definite: c is too large or two centres are equal");
  }
  model->measure_bias_span();
  return ModelPtr(std::move(model));
}

bool LssvmModel::factorise() {
  Eigen::MatrixXd kernel = kernel_matrix(parameters_.centres, parameters_.sigma2);
  const Eigen::MatrixXd& gram = parameters_.uncertainty->gram;
  if (gram.size() > 0) {
    posterior_ = PosteriorVariance::sparse(std::move(kernel), gram, parameters_.c);
  } else {
    kernel.diagonal().array() += 1 / (parameters_.c * parameters_.weight.array());
    posterior_ = PosteriorVariance::dense(std::move(kernel));
  }
  return posterior_.has_value();
}

double LssvmModel::bias_deg_per_h(std::span<const double> inputs) const {
  const Normalisation& n = parameters_.normalisation;
  return (centres_.sum(n.of(inputs), parameters_.alpha) + parameters_.b) * n.target_scale + n.target_shift;
}

double LssvmModel::variance_fraction(std::span<const double> inputs) const {
  Eigen::VectorXd k(parameters_.alpha.size());
  centres_.row(parameters_.normalisation.of(inputs), k.data());
  return posterior_->at(std::move(k), 1);
}

Prediction LssvmModel::predict(std::span<const double> inputs) const {
  Prediction prediction;
  prediction.bias_deg_per_h = bias_deg_per_h(inputs);
  prediction.extrapolating = outside_domain(inputs);
  prediction.mean_deg_per_h = parameters_.normalisation.target_shift;
  const auto& u = parameters_.uncertainty;
  const double scale = parameters_.normalisation.target_scale;
  if (u) {
    const double fraction = variance_fraction(inputs), variance = u->prior_variance * scale * scale;
    prediction.extrapolating = prediction.extrapolating || fraction > u->guard_fraction;
    prediction.sd_deg_per_h = std::sqrt(u->prior_variance * fraction) * u->sd_scale * scale;
    const BetweenRunError own{0, 0, std::sqrt(variance / parameters_.c), u->sd_scale};
    prediction.knowledge = {variance * fraction, scale * scale, 1, excess(inputs), info().spread.value_or(own), false};
  }
  if (!info().spread) return prediction;
  return stated(prediction, prediction.knowledge.value_or(PredictiveUncertainty{0, 0, 1, 0, *info().spread, false}), 1);
}

// The LSSVM part of the model file: normalisation, hyper-parameters, centres, alphas, weights and the uncertainty.

namespace {

JsonTable<LssvmUncertainty> uncertainty_keys() {
  using U = LssvmUncertainty;
  JsonTable<U> keys;
  keys.number("prior_variance", kPositive, &U::prior_variance, kRequired)
      .number("sd_scale", {1, 1e6}, &U::sd_scale, "")
      .number("guard_fraction", kPositive, &U::guard_fraction, kRequired);
  return add_symmetric(keys, "gram", &U::gram);
}

const JsonTable<LssvmParameters>& lssvm_table() {
  using P = LssvmParameters;
  static const JsonTable<P> keys = JsonTable<P>()
                                       .number("c", kPositive, &P::c, kRequired)
                                       .number("sigma2", kPositive, &P::sigma2, kRequired)
                                       .number("b", kAnyNumber, &P::b, kRequired)
                                       .object("normalisation", normalisation_keys(), &P::normalisation, kRequired)
                                       .numbers("linear", kAnyNumber, &P::linear, "")
                                       .number("linear_b", kAnyNumber, &P::linear_b, "")
                                       .print_if([](const P& p) { return p.linear.size() > 0; })
                                       .object("uncertainty", uncertainty_keys(), &P::uncertainty, "")
                                       .numbers("centres", kAnyNumber, &P::centres, {kRequired, "one after the other"})
                                       .numbers("alpha", kAnyNumber, &P::alpha, kRequired)
                                       .numbers("weight", kPositive, &P::weight, "");
  return keys;
}

}  // namespace

Json lssvm_keys() { return lssvm_table().schema()["properties"]; }

Result<ModelPtr> read_lssvm(Section& top, ModelInfo info) {
  LssvmParameters p;
  lssvm_table().read(top, p);
  shape_centres(top, p.centres, info.inputs.size(), p.alpha.size());
  if (!top.good()) return tl::unexpected<Error>(top.finish().error());
  return LssvmModel::make(std::move(info), std::move(p));
}

Json print_lssvm(const Model& model) { return lssvm_table().print(static_cast<const LssvmModel&>(model).parameters()); }

}  // namespace prism::compensation
