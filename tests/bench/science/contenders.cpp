// SPDX-License-Identifier: MIT
#include "tests/bench/science/contenders.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <numeric>

namespace prism::science {
namespace {

training::TrainingSettings settings_of(const Contender& contender, std::size_t inputs) {
  training::TrainingSettings settings;
  settings.method = training::find_method(contender.method);
  settings.tuning = contender.tuning;
  settings.threads = 1;
  if (contender.method != "stepwise") return settings;
  settings.terms = training::second_order_terms(inputs);
  for (std::size_t i = 0; i < settings.terms.size(); ++i) {
    const std::string name = training::term_name(settings.terms[i], {"T", "dTdt", "U"});
    if (name == "T" || name == "T^2" || name == "dTdt") settings.stepwise.start.push_back(static_cast<int>(i));
  }
  return settings;
}

}  // namespace

training::TrainedModel fitted(const Contender& contender, const training::TrainingData& data,
                              const std::vector<compensation::ModelPtr>& siblings) {
  training::TrainingSettings settings = settings_of(contender, static_cast<std::size_t>(data.inputs.rows()));
  settings.siblings = siblings;
  auto model = training::train(data, {}, settings);
  if (!model) {
    fmt::print(stderr, "{}: {}\n", contender.name, model.error().text());
    std::exit(1);
  }
  return std::move(*model);
}

compensation::ModelPtr trained(const Contender& contender, const training::TrainingData& data) {
  return fitted(contender, data).model;
}

Served serve(const compensation::Model& model, const training::TrainingData& data, compensation::Extrapolation policy) {
  const Eigen::Index n = data.target.size();
  Served served{Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::VectorXd(n), {}};
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::VectorXd x = data.inputs.col(i);
    const compensation::Prediction p =
        compensation::predict_within(model, {x.data(), static_cast<std::size_t>(x.size())}, policy);
    served.bias[i] = p.bias_deg_per_h;
    served.sd[i] = p.sd_deg_per_h;
    served.sd_mean[i] = p.sd_mean_deg_per_h;
    served.flagged.push_back(p.extrapolating);
  }
  return served;
}

Eigen::VectorXd biases_of(const compensation::Model& model, const training::TrainingData& data) {
  Eigen::VectorXd bias(data.target.size());
  for (Eigen::Index i = 0; i < bias.size(); ++i) {
    const Eigen::VectorXd x = data.inputs.col(i);
    bias[i] = model.bias_deg_per_h({x.data(), static_cast<std::size_t>(x.size())});
  }
  return bias;
}

double covered(const Eigen::VectorXd& error, const Eigen::VectorXd& sd) {
  return (error.array().abs() <= 2 * sd.array()).cast<double>().mean();
}

double mean(const std::vector<double>& values) {
  if (values.empty()) return kUnknown;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace prism::science
