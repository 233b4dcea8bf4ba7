// SPDX-License-Identifier: MIT
#include "compensation/composite_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/json_table.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/kernel.hpp"
#include "compensation/model.hpp"
#include "compensation/model_text.hpp"

namespace prism::compensation {

PopulationPrior::PriorPrediction PopulationPrior::at(std::span<const double> inputs) const {
  const auto count = static_cast<double>(models.size());
  double sum = 0, squares = 0;
  PriorPrediction prediction;
  for (std::size_t s = 0; s < models.size(); ++s) {
    const std::vector<double> nearest = nearest_in_box(*models[s], inputs);
    const double drift = models[s]->bias_deg_per_h(nearest) - levels[s];
    sum += drift;
    squares += drift * drift;
    prediction.extrapolating = prediction.extrapolating || !std::equal(inputs.begin(), inputs.end(), nearest.begin());
  }
  const double mean = sum / count, spread = std::max(0.0, squares - sum * mean) / (count - 1);
  prediction.mean_deg_per_h = scale * mean;
  prediction.variance = scale * scale * spread * (1 + 1 / count);
  return prediction;
}

namespace {

std::string canonical(const CompositeParameters& p) {
  const CompositeVariances& v = p.variances;
  const UncertaintySettings& t = p.trust;
  const Normalisation& n = p.normalisation;
  std::string text =
      exact_texts(std::vector{v.kernel.rbf, v.kernel.linear, v.kernel.quadratic, v.nuisance, v.nuisance_time_h,
                              v.offset, v.noise, p.beta, n.target_shift, n.target_scale, t.skill, t.level, t.guard});
  for (const Eigen::MatrixXd& part :
       {Eigen::MatrixXd(v.kernel.length2), Eigen::MatrixXd(n.input_shift), Eigen::MatrixXd(n.input_scale), p.centres,
        Eigen::MatrixXd(p.alpha), Eigen::MatrixXd(p.weight), Eigen::MatrixXd(p.time_h), p.gram}) {
    text += '\n' + exact_numbers(part);
  }
  text += fmt::format("\n{}", fmt::join(p.recording, " "));
  if (!t.relevance.empty()) text += "\nedge " + exact_text(t.overlap) + ' ' + exact_texts(t.relevance);
  if (v.warm_up > 0) text += "\nwarm-up " + exact_text(v.warm_up);
  if (!p.prior) return text;
  text += "\nprior " + exact_text(p.prior->scale) + ' ' + exact_texts(p.prior->levels);
  for (const ModelPtr& sibling : p.prior->models) text += ' ' + sibling->info().id;
  return text;
}

std::string wrong_shape(const ModelInfo& info, const CompositeParameters& p) {
  const auto d = static_cast<Eigen::Index>(info.inputs.size()), n = p.centres.cols();
  if (!info.spread) return "found no spread, expected one";
  if (p.prior) {
    if (p.prior->models.size() < 2 || p.prior->levels.size() != p.prior->models.size())
      return fmt::format("found {} models and {} levels in the prior, expected at least 2 and a level for each",
                         p.prior->models.size(), p.prior->levels.size());
    for (const ModelPtr& sibling : p.prior->models) {
      const ModelInfo& other = sibling->info();
      if (other.inputs != info.inputs || other.features != info.features || other.table != info.table)
        return fmt::format("model {:.12} of the prior has different inputs or features", other.id);
    }
  }
  if (std::string wrong = wrong_centres(info, p.normalisation, p.centres, p.alpha.size()); !wrong.empty()) return wrong;
  if (const Eigen::Index lengths = p.variances.kernel.length2.size(); lengths != d)
    return fmt::format("found {} lengths, expected {}", lengths, d);
  if (!p.trust.relevance.empty() && p.trust.relevance.size() != info.inputs.size())
    return fmt::format("found {} shares in relevance, expected {}", p.trust.relevance.size(), d);
  if (p.gram.size() > 0) {
    if (p.gram.rows() != n + 1) return fmt::format("gram has {} rows, expected {}", p.gram.rows(), n + 1);
    return {};
  }
  if (p.weight.size() != n || p.time_h.size() != n || static_cast<Eigen::Index>(p.recording.size()) != n) {
    return fmt::format("found {} weights, {} times and {} recordings, expected {} of each", p.weight.size(),
                       p.time_h.size(), p.recording.size(), n);
  }
  return {};
}

}  // namespace

Eigen::MatrixXd nuisance_matrix(const CompositeVariances& variances, const Eigen::VectorXd& time_h,
                                const std::vector<int>& recording) {
  const Eigen::Index n = time_h.size();
  Eigen::MatrixXd q = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index begin = 0; begin < n;) {
    Eigen::Index end = begin;
    while (end < n && recording[static_cast<std::size_t>(end)] == recording[static_cast<std::size_t>(begin)]) ++end;
    const auto time = time_h.segment(begin, end - begin).array();
    for (Eigen::Index j = begin; j < end; ++j) {
      q.col(j).segment(begin, end - begin) =
          variances.nuisance * (-(time - time_h[j]).abs() / variances.nuisance_time_h).exp() + variances.offset;
    }
    begin = end;
  }
  return q;
}

void add_warm_up(const CompositeVariances& variances, const Eigen::VectorXd& time_h, Eigen::MatrixXd& h) {
  constexpr double kWarmUp_h = 1;
  if (!(variances.warm_up > 0)) return;
  const Eigen::VectorXd w = (-time_h.array() / kWarmUp_h).exp();
  h.noalias() += variances.warm_up * w * w.transpose();
}

// Of an Ornstein-Uhlenbeck process (Rybicki and Press 1995): 1ᵀq⁻¹1 = (1 + Σ tanh(Δt / 2 tau)) / s4².
double nuisance_level(const CompositeVariances& variances, const Eigen::VectorXd& time_h,
                      const std::vector<int>& recording) {
  if (recording.empty() || recording.front() != recording.back()) return 0;
  double information = 1;
  for (Eigen::Index i = 1; i < time_h.size(); ++i)
    information += std::tanh(std::abs(time_h[i] - time_h[i - 1]) / (2 * variances.nuisance_time_h));
  return variances.nuisance / information;
}

CompositeModel::CompositeModel(ModelInfo info, CompositeParameters parameters)
    : Model(std::move(info), canonical(parameters)),
      parameters_(std::move(parameters)),
      centres_(parameters_.variances.kernel, parameters_.centres) {
  centres_.weigh(parameters_.alpha);
}

Result<ModelPtr> CompositeModel::make(ModelInfo info, CompositeParameters parameters) {
  const std::string where = info.name.empty() ? info.kind : info.name;
  if (std::string wrong = wrong_shape(info, parameters); !wrong.empty()) return make_error(where, std::move(wrong));
  std::shared_ptr<CompositeModel> model(new CompositeModel(std::move(info), std::move(parameters)));
  if (!model->factorise())
    return make_error(where, "the covariance of the centres is not positive definite: noise is too small");
  model->measure_bias_span();
  return ModelPtr(std::move(model));
}

bool CompositeModel::factorise() {
  const CompositeParameters& p = parameters_;
  Eigen::MatrixXd kernel = p.variances.kernel.matrix(p.centres);
  if (p.gram.size() > 0) {
    kernel.diagonal().array() += kCompositeJitter * p.variances.kernel.rbf;
    posterior_ = PosteriorVariance::sparse(std::move(kernel), p.gram, 1);
  } else {
    kernel += nuisance_matrix(p.variances, p.time_h, p.recording);
    add_warm_up(p.variances, p.time_h, kernel);
    kernel.diagonal().array() += p.variances.noise / p.weight.array() + kCompositeJitter;
    posterior_ = PosteriorVariance::dense(std::move(kernel));
  }
  return posterior_.has_value();
}

double CompositeModel::own_bias_deg_per_h(const Eigen::VectorXd& x) const {
  const Normalisation& n = parameters_.normalisation;
  return (centres_.sum(x) + parameters_.beta) * n.target_scale + n.target_shift;
}

double CompositeModel::bias_deg_per_h(std::span<const double> inputs) const {
  const double own = own_bias_deg_per_h(parameters_.normalisation.of(inputs));
  return parameters_.prior ? own + parameters_.prior->at(inputs).mean_deg_per_h : own;
}

double CompositeModel::variance(const Eigen::VectorXd& x) const {
  return posterior_->at(centres_.row(x), parameters_.variances.kernel.variance(x));
}

std::vector<double> CompositeModel::edge_of(std::span<const double> inputs) const {
  std::vector<double> edge = nearest_in_box(*this, inputs);
  for (std::size_t i = 0; i < edge.size(); ++i) {
    if (is_slope(info().inputs[i])) edge[i] = inputs[i];
  }
  return edge;
}

Prediction CompositeModel::predict(std::span<const double> inputs) const {
  const UncertaintySettings& trust = parameters_.trust;
  const Normalisation& normalisation = parameters_.normalisation;
  const double scale = normalisation.target_scale, square = scale * scale;
  // With q − level instead of q the mean is the same, and the variance is lower by level everywhere.
  const Eigen::VectorXd x = normalisation.of(inputs);
  const double fraction = std::max(0.0, variance(x) - trust.level);
  // Outside the training range, shrink towards the population prior, as far as its gyros agree.
  const auto prior = parameters_.prior ? parameters_.prior->at(inputs) : PopulationPrior::PriorPrediction{0, 0, true};
  Prediction prediction;
  prediction.bias_deg_per_h = own_bias_deg_per_h(x) + prior.mean_deg_per_h;
  prediction.extrapolating = (outside_domain(inputs) || fraction > trust.guard) && prior.extrapolating;
  prediction.mean_deg_per_h = normalisation.target_shift + prior.mean_deg_per_h;
  prediction.knowledge = {fraction * square, square + prior.variance,
                          trust.skill,       excess(inputs, trust.relevance),
                          *info().spread,    true,
                          trust.overlap,     {}};
  if (!trust.relevance.empty()) {
    PredictiveUncertainty::Edge edge{prediction.bias_deg_per_h, fraction * square};
    if (const std::vector<double> nearest = edge_of(inputs);
        !std::equal(nearest.begin(), nearest.end(), inputs.begin(), inputs.end())) {
      const Eigen::VectorXd at = normalisation.of(nearest);
      edge.bias_deg_per_h = own_bias_deg_per_h(at) + prior.mean_deg_per_h;
      edge.model_variance = std::max(0.0, variance(at) - trust.level) * square;
    }
    prediction.knowledge->edge = edge;
  }
  return stated(prediction, *prediction.knowledge, 1);
}

// The composite kernel's part of the model file: variances, centres and the uncertainty parameters.

namespace {

JsonTable<CompositeVariances> variance_keys() {
  using V = CompositeVariances;
  using K = CompositeKernel;
  return JsonTable<V>()
      .group(JsonTable<K>()
                 .number("smooth", kPositive, &K::rbf, kRequired)
                 .numbers("length_squared", kPositive, &K::length2, kRequired)
                 .number("linear", kPositive, &K::linear, kRequired)
                 .number("quadratic", kPositive, &K::quadratic, kRequired),
             &V::kernel)
      .number("nuisance", kPositive, &V::nuisance, kRequired)
      .number("nuisance_time_h", kPositive, &V::nuisance_time_h, kRequired)
      .number("offset", {0, 1e300}, &V::offset, "")
      .number("noise", kPositive, &V::noise, kRequired)
      .number("warm_up", {0, 1e300}, &V::warm_up, "")
      .print_if([](const V& variances) { return variances.warm_up > 0; });
}

JsonTable<UncertaintySettings> trust_keys() {
  using U = UncertaintySettings;
  return JsonTable<U>()
      .number("skill", {-1e300, 1}, &U::skill, kRequired)
      .number("level", {0, 1e300}, &U::level, kRequired)
      .number("guard", kPositive, &U::guard, kRequired)
      .number("overlap", {0, 1}, &U::overlap, "")
      .print_if([](const U& trust) { return !trust.relevance.empty(); })
      .numbers("relevance", {0, 1}, &U::relevance, "");
}

JsonTable<PopulationPrior> prior_keys() {
  using P = PopulationPrior;
  const Json models = {{"type", "array"}, {"minItems", 2}, {"items", {{"$ref", "#"}}}};
  return JsonTable<P>()
      .number("scale", kPositive, &P::scale, kRequired)
      .numbers("levels", kAnyNumber, &P::levels, kRequired)
      .custom(
          "models", models, kRequired,
          [](const Section& section, P& prior) {
            for (Section& sibling : section.objects("models")) {
              const auto model = read_model(sibling);
              if (!model && sibling.good()) sibling.fail("", model.error().what);
              if (!sibling.good()) return;
              prior.models.push_back(*model);
            }
          },
          [](const P& prior, Json& json) {
            for (const ModelPtr& sibling : prior.models) json["models"].push_back(Json::parse(format_model(*sibling)));
          });
}

JsonTable<CompositeParameters> make_keys() {
  using P = CompositeParameters;
  JsonTable<P> keys;
  keys.object("variances", variance_keys(), &P::variances, kRequired)
      .object("prior", prior_keys(), &P::prior, "prior from the models of gyros of the same type")
      .object("trust", trust_keys(), &P::trust, kRequired)
      .number("beta", kAnyNumber, &P::beta, kRequired)
      .object("normalisation", normalisation_keys(), &P::normalisation, kRequired)
      .numbers("centres", kAnyNumber, &P::centres, {kRequired, "one after the other"})
      .numbers("alpha", kAnyNumber, &P::alpha, kRequired)
      .numbers("weight", kPositive, &P::weight, "")
      .numbers("time_h", kAnyNumber, &P::time_h, "")
      .value(
          "recording", {{"type", "array"}, {"items", limits_schema("integer", {0, 1e6})}}, &P::recording, "",
          [](const Section& section, const std::string& key) {
            std::vector<int> recording;
            for (const double number : section.numbers(key, {0, 1e6})) {
              recording.push_back(static_cast<int>(number));
              if (recording.back() != number) section.fail(key, fmt::format("found {}, expected integers", number));
            }
            return recording;
          },
          [](const std::vector<int>& recording) { return recording.empty() ? Json() : Json(recording); });
  return add_symmetric(keys, "gram", &P::gram);
}

const JsonTable<CompositeParameters>& composite_table() {
  static const JsonTable<CompositeParameters> keys = make_keys();
  return keys;
}

}  // namespace

Json composite_keys() { return composite_table().schema()["properties"]; }

Result<ModelPtr> read_composite(Section& top, ModelInfo info) {
  CompositeParameters p;
  composite_table().read(top, p);
  shape_centres(top, p.centres, info.inputs.size(), p.alpha.size());
  if (!top.good()) return tl::unexpected<Error>(top.finish().error());
  return CompositeModel::make(std::move(info), std::move(p));
}

Json print_composite(const Model& model) {
  return composite_table().print(static_cast<const CompositeModel&>(model).parameters());
}

}  // namespace prism::compensation
