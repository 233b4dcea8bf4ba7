// SPDX-License-Identifier: MIT
// The methods that the tables compare, trained and served with their defaults.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "compensation/extrapolation.hpp"
#include "compensation/training/trainer.hpp"

namespace prism::science {

struct Contender {
  const char* name;
  std::string_view method;  ///< of training
  training::Tuning tuning;
  compensation::Extrapolation policy;
};

/// The composite kernel first, then the others.
inline constexpr std::array<Contender, 4> kContenders = {{
    {"composite", "composite", training::Tuning::kReml, compensation::Extrapolation::kPreset},
    {"stepwise 2", "stepwise", training::Tuning::kReml, compensation::Extrapolation::kPreset},
    {"blocked", "ir-lssvm", training::Tuning::kBlocked, compensation::Extrapolation::kPreset},
    {"REML", "ir-lssvm", training::Tuning::kReml, compensation::Extrapolation::kPreset},
}};

/// Ends the program if training fails: a table with a missing cell would mislead.
training::TrainedModel fitted(const Contender& contender, const training::TrainingData& data,
                              const std::vector<compensation::ModelPtr>& siblings = {});
compensation::ModelPtr trained(const Contender& contender, const training::TrainingData& data);

/// Predictions of a model for every row.
struct Served {
  Eigen::VectorXd bias, sd, sd_mean;  ///< deg/h; sds are kUnknown if the model type has none
  std::vector<bool> flagged;
};
Served serve(const compensation::Model& model, const training::TrainingData& data, compensation::Extrapolation policy);

/// The biases alone, for a policy that leaves them as they are: the standard deviations cost far more.
Eigen::VectorXd biases_of(const compensation::Model& model, const training::TrainingData& data);

/// Share of the errors within 2 sd.
double covered(const Eigen::VectorXd& error, const Eigen::VectorXd& sd);

double mean(const std::vector<double>& values);

}  // namespace prism::science
