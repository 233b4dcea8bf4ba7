// SPDX-License-Identifier: MIT
// A short record with a population prior: models of gyros of the same type give the shape, the record its scale.
#include <fmt/format.h>

#include <algorithm>

#include "compensation/extrapolation.hpp"
#include "compensation/training/composite.hpp"
#include "compensation/training/dense.hpp"
#include "compensation/training/trainer.hpp"

namespace prism::training {
namespace {

constexpr double kScaleSpread = 0.3;  // prior sd of one gyro's drift over that of another of the same type
constexpr Eigen::Index kScaleSamples = 1000;

Result<void> check(const TrainingData& data, const compensation::ModelInfo& info, const TrainingSettings& settings) {
  if (!settings.method->has(kSiblings))
    return make_error(
        "prior", fmt::format("found method {}, expected {}", settings.method->name, method_names(kSiblings, " or ")));
  if (settings.siblings.size() < 2)
    return make_error("prior", fmt::format("found {} models, expected at least 2", settings.siblings.size()));
  for (const compensation::ModelPtr& sibling : settings.siblings) {
    const compensation::ModelInfo& other = sibling->info();
    const std::string who = fmt::format("prior, model {:.12} of {}", other.id, other.gyro_serial);
    if (other.inputs != data.names)
      return make_error(
          who, fmt::format("found inputs {}, expected {}", fmt::join(other.inputs, ","), fmt::join(data.names, ",")));
    if (other.features != info.features || other.table != info.table)
      return make_error(who, "has different features: window, slope or lags");
    if (other.domain.min.empty()) return make_error(who, "contains no ranges of its inputs");
  }
  return {};
}

compensation::PopulationPrior prior_of(const TrainingData& data, const std::vector<compensation::ModelPtr>& siblings) {
  compensation::PopulationPrior prior{1, siblings, {}};
  for (const compensation::ModelPtr& sibling : siblings) {
    double sum = 0;
    for (Eigen::Index i = 0; i < data.inputs.cols(); ++i)
      sum += sibling->bias_deg_per_h(compensation::nearest_in_box(*sibling, column(data.inputs, i)));
    prior.levels.push_back(sum / static_cast<double>(data.inputs.cols()));
  }
  return prior;
}

Eigen::VectorXd said(const compensation::PopulationPrior& prior, const Eigen::MatrixXd& inputs) {
  Eigen::VectorXd mean(inputs.cols());
  for (Eigen::Index i = 0; i < inputs.cols(); ++i) mean[i] = prior.at(column(inputs, i)).mean_deg_per_h;
  return mean;
}

// Generalised least squares for y = beta + scale · m + f + n + e with a normal prior about 1 for scale: with P = C⁻¹
// minus its level, (mᵀP(y − m)) / (mᵀPm + 1/spread²), C from the first training.
double scale_of(const TrainingData& data, const Eigen::VectorXd& m, const TrainedModel& first) {
  const auto& p = static_cast<const compensation::CompositeModel&>(*first.model).parameters();
  const Rows some = thinned(m.size(), kScaleSamples);
  const double scale = p.normalisation.target_scale;
  CompositeSamples samples{normalised_inputs(data.inputs(Eigen::all, some), p.normalisation),
                           (data.target(some) - m(some)) / scale,
                           time_of(data)(some),
                           taken(runs_of(data), some),
                           1,
                           p.variances.warm_up};
  const Eigen::VectorXd theta = composite_theta(p.variances, p.variances.offset > 0);
  const Eigen::VectorXd weight = first.samples.weight(some);
  const auto own = CompositeSystem::make(samples, theta, weight);
  samples.y = m(some) / scale;
  const auto theirs = CompositeSystem::make(samples, theta, weight);
  if (!own || !theirs) return 1;
  const double information = samples.y.dot(theirs->alpha()) + 1 / (kScaleSpread * kScaleSpread);
  return std::clamp(1 + samples.y.dot(own->alpha()) / information, 0.1, 10.0);
}

}  // namespace

Result<TrainedModel> train_with_siblings(const TrainingData& data, compensation::ModelInfo info,
                                         const TrainingSettings& wanted) {
  if (auto good = check(data, info, wanted); !good) return tl::unexpected<Error>(good.error());
  TrainingSettings settings = wanted;
  settings.siblings.clear();
  settings.prior = prior_of(data, wanted.siblings);
  const Eigen::VectorXd m = said(*settings.prior, data.inputs);
  TrainingData rest = data;
  rest.target = data.target - m;
  // train() has left out gross outliers: a second search would number the rows of the rest.
  auto trained = train_checked(rest, info, settings);
  if (!trained) return trained;
  settings.prior->scale = scale_of(data, m, *trained);
  rest.target = data.target - settings.prior->scale * m;
  trained = train_checked(rest, std::move(info), settings);
  if (!trained) return trained;
  trained->samples.fitted += settings.prior->scale * m;
  const auto square = [](const Eigen::VectorXd& v) { return (v.array() - v.mean()).square().sum(); };
  const double moved = square(data.target);
  trained->from_siblings = moved > 0 ? 1 - square(rest.target) / moved : 0;
  return trained;
}

}  // namespace prism::training
