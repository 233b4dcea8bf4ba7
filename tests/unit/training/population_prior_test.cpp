// SPDX-License-Identifier: MIT
// A short record of a gyro with a population prior: simulated gyros of one type, similar in shape, each with a scale.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "compensation/composite_model.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/model_text.hpp"
#include "compensation/training/trainer.hpp"

namespace prism::training {
namespace {

struct Gyro {
  double level, scale, tilt;

  double bias(double t) const { return level + scale * (0.02 * std::sin(t / 15) + 1e-4 * t) + tilt * t; }
  /// `rows` of a cycle of 400 over ±60 degC, from `from` on.
  TrainingData record(Eigen::Index from, Eigen::Index rows, unsigned seed) const {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    TrainingData data{{"T"}, Eigen::MatrixXd(1, rows), Eigen::VectorXd(rows), {}, {}};
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double t = -60 * std::cos(6.2832 * static_cast<double>(from + i) / 400);
      data.inputs(0, i) = t;
      data.target[i] = bias(t) + 0.003 * normal(random);
    }
    return data;
  }
};

TrainingSettings composite() {
  TrainingSettings settings;
  return settings;
}

std::vector<compensation::ModelPtr> siblings() {
  std::vector<compensation::ModelPtr> models;
  for (const Gyro& gyro : {Gyro{0.3, 1, 2e-5}, Gyro{-0.1, 1.1, 0}, Gyro{0.5, 0.9, -3e-5}, Gyro{0, 1.05, 2e-5}}) {
    compensation::ModelInfo info;
    info.gyro_serial = std::to_string(models.size());
    const auto trained = train(gyro.record(0, 400, static_cast<unsigned>(models.size())), info, composite());
    EXPECT_TRUE(trained);
    models.push_back(trained->model);
  }
  return models;
}

const Gyro kOwn{1.2, 1.2, 1e-5};

// Rms over the cycle, level removed, and the fraction within 2 sd with the level.
std::pair<double, double> judged(const compensation::Model& model) {
  Eigen::VectorXd error(41);
  double covered = 0;
  for (Eigen::Index i = 0; i < 41; ++i) {
    const double t = -60 + 3 * static_cast<double>(i);
    const auto p = compensation::predict_within(model, std::vector{t}, compensation::Extrapolation::kPreset);
    error[i] = kOwn.bias(t) - p.bias_deg_per_h;
    covered += std::fabs(error[i]) < 2 * p.sd_deg_per_h;
  }
  return {std::sqrt((error.array() - error.mean()).square().mean()), covered / 41};
}

TEST(Siblings, AShortRecordPredictsTheCompleteCycle) {
  const TrainingData data = kOwn.record(0, 80, 77);  // -60 to -19 degC
  TrainingSettings settings = composite();
  const auto alone = train(data, {}, settings);
  settings.siblings = siblings();
  const auto together = train(data, {}, settings);
  ASSERT_TRUE(alone && together);
  const auto [alone_rms, alone_covered] = judged(*alone->model);
  const auto [rms, covered] = judged(*together->model);
  EXPECT_LT(rms, 0.003);
  EXPECT_LT(rms, alone_rms / 3);
  EXPECT_GT(covered, 0.9);
  const auto& prior = static_cast<const compensation::CompositeModel&>(*together->model).parameters().prior;
  ASSERT_TRUE(prior);
  EXPECT_GT(prior->scale, 1.03);  // 1.19, shrunk towards 1 by the prior of the scale
  EXPECT_LT(prior->scale, 1.25);
  EXPECT_GT(*together->from_siblings, 0.8);
  EXPECT_FALSE(
      together->model->predict(std::vector{40.0}).extrapolating);  // within the training range of the prior's models
  EXPECT_TRUE(together->model->predict(std::vector{90.0}).extrapolating);
}

TEST(Siblings, ItsFileReadsBackAsTheSameModel) {
  TrainingSettings settings = composite();
  settings.siblings = siblings();
  const auto trained = train(kOwn.record(0, 80, 78), {}, settings);
  ASSERT_TRUE(trained);
  std::string text = compensation::format_model(*trained->model);
  const auto read = compensation::parse_model(text, "m.json");
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ((*read)->info().id, trained->model->info().id);
  for (const double t : {-70.0, -40.0, 30.0}) {
    const auto a = trained->model->predict(std::vector{t}), b = (*read)->predict(std::vector{t});
    EXPECT_EQ(a.bias_deg_per_h, b.bias_deg_per_h);
    EXPECT_EQ(a.sd_deg_per_h, b.sd_deg_per_h);
  }
  const std::string key = "\"scale\": ";
  text.insert(text.find(key) + key.size(), "1");
  EXPECT_FALSE(compensation::parse_model(text, "m.json"));
  text = compensation::format_model(*trained->model);
  const std::size_t within = text.find("\"length_s\": ", text.find("\"prior\"")) + 12;
  text.insert(within, "1");
  const auto damaged = compensation::parse_model(text, "m.json");
  ASSERT_FALSE(damaged);
  EXPECT_NE(damaged.error().text().find("m.json:/prior/models/0"), std::string::npos) << damaged.error().text();
}

TEST(Siblings, RejectsUnsuitableModels) {
  TrainingSettings settings = composite();
  settings.siblings = siblings();
  TrainingData other = kOwn.record(0, 80, 79);
  other.names = {"U"};
  EXPECT_NE(train(other, {}, settings).error().text().find("found inputs T, expected U"), std::string::npos);
  settings.siblings.resize(1);
  EXPECT_EQ(train(kOwn.record(0, 80, 79), {}, settings).error().text(), "prior: found 1 models, expected at least 2");
  settings.siblings = siblings();
  settings.method = find_method("ls");
  settings.terms = cubic_terms();
  EXPECT_EQ(train(kOwn.record(0, 80, 79), {}, settings).error().text(), "prior: found method ls, expected composite");
}

}  // namespace
}  // namespace prism::training
