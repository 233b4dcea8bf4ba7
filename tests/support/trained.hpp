// SPDX-License-Identifier: MIT
// Trainings for tests: records of a known function, trained models, and their files.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "compensation/extrapolation.hpp"
#include "compensation/model_text.hpp"
#include "compensation/training/trainer.hpp"

namespace prism::test {

/// `rows` rows: `row` gets the number of one and its inputs, which it sets, and returns the target.
inline training::TrainingData record(std::vector<std::string> inputs, Eigen::Index rows,
                                     const std::function<double(double row, double* inputs)>& row) {
  training::TrainingData data;
  data.names = std::move(inputs);
  data.inputs.resize(std::ssize(data.names), rows);
  data.target.resize(rows);
  for (Eigen::Index i = 0; i < rows; ++i) data.target[i] = row(static_cast<double>(i), data.inputs.col(i).data());
  return data;
}

inline training::TrainingSettings settings_of(std::string_view method, std::optional<double> c = {},
                                              std::optional<double> sigma2 = {}) {
  training::TrainingSettings settings;
  settings.method = training::find_method(method);
  settings.c = c, settings.sigma2 = sigma2;
  return settings;
}

/// Throws the error of train().
inline training::TrainedModel trained(const training::TrainingData& data, const training::TrainingSettings& settings,
                                      const std::string& serial = "") {
  compensation::ModelInfo info;
  info.gyro_serial = serial;
  auto made = training::train(data, info, settings);
  if (!made) throw std::runtime_error(made.error().text());
  return std::move(*made);
}

inline std::string training_error(const training::TrainingData& data, const training::TrainingSettings& settings) {
  const auto made = training::train(data, {}, settings);
  return made ? "" : made.error().text();
}

/// As prismd serves it by default.
inline compensation::Prediction served(const compensation::Model& model, const std::vector<double>& inputs) {
  return compensation::predict_within(model, inputs, compensation::Extrapolation::kPreset);
}

/// The model from its file: the same id, and the same predictions, to the last bit, for `inputs`.
inline compensation::ModelPtr read_back(const compensation::Model& model,
                                        const std::vector<std::vector<double>>& inputs) {
  const auto read = compensation::parse_model(compensation::format_model(model), "m.json");
  if (!read) throw std::runtime_error(read.error().text());
  EXPECT_EQ((*read)->info().id, model.info().id);
  EXPECT_EQ((*read)->info().spread, model.info().spread);
  for (const auto& each : inputs) {
    const compensation::Prediction a = model.predict(each), b = (*read)->predict(each);
    EXPECT_EQ(a.bias_deg_per_h, b.bias_deg_per_h);
    EXPECT_EQ(a.sd_deg_per_h, b.sd_deg_per_h);
  }
  return *read;
}

/// The error of a model's file after a 1 was inserted behind `key`, searched from `after` on.
inline std::string error_after_edit(const compensation::Model& model, const std::string& key,
                                    const std::string& after = "") {
  std::string text = compensation::format_model(model);
  text.insert(text.find(key, text.find(after)) + key.size(), "1");
  const auto read = compensation::parse_model(text, "m.json");
  return read ? "" : read.error().text();
}

}  // namespace prism::test
