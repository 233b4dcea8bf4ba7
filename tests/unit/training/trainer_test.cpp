// SPDX-License-Identifier: MIT
// From samples to a model: every method finds a simulated truth and a valid standard deviation.
#include "compensation/training/trainer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "compensation/lssvm_model.hpp"
#include "compensation/model_text.hpp"

namespace prism::training {
namespace {

constexpr double kNoise = 0.01;

double truth(double t, double u) { return 0.3 + 0.02 * std::sin(t / 20) + 0.05 * (u - 5.5); }

// A drift in engineering units with noise of 0.01 · 0.02 deg/h and 3 % outliers.
TrainingData drift(Eigen::Index n, bool outliers = true) {
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal;
  TrainingData data;
  data.names = {"T", "U"};
  data.inputs.resize(2, n);
  data.target.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = 60 * std::sin(static_cast<double>(i) * 0.05),
                 u = 5.5 + 0.1 * std::cos(static_cast<double>(i) * 0.031);
    data.inputs.col(i) << t, u;
    data.target[i] = truth(t, u) + 0.02 * kNoise * normal(random) + (outliers && i % 33 == 7 ? 0.2 : 0);
  }
  return data;
}

double worst_error(const compensation::Model& model) {
  double worst = 0;
  for (double t = -50; t <= 50; t += 5) {
    for (double u = 5.45; u < 5.56; u += 0.05)
      worst = std::max(worst, std::fabs(model.predict(std::vector{t, u}).bias_deg_per_h - truth(t, u)));
  }
  return worst;
}

TEST(Trainer, RobustWeightsIgnoreOutliersThatLssvmFollows) {
  TrainingSettings settings;
  settings.c = 300, settings.sigma2 = 0.5;
  settings.method = find_method("lssvm");
  const auto plain = train(drift(400), {}, settings);
  settings.method = find_method("ir-lssvm");
  const auto robust = train(drift(400), {}, settings);
  ASSERT_TRUE(plain && robust);
  EXPECT_LT(worst_error(*robust->model), 0.2 * worst_error(*plain->model));
  EXPECT_LT(worst_error(*robust->model), 0.001);
  EXPECT_EQ(robust->model->info().kind, "ir_lssvm");
  EXPECT_LT(robust->samples.weight[7], 0.05);
}

TEST(Trainer, TheStatedDeviationCoversTheError) {
  TrainingSettings settings;
  settings.method = find_method("ir-lssvm");
  settings.reweight.weight.kind = WeightKind::kHuber;
  settings.tuning = Tuning::kShuffled;
  const auto trained = train(drift(300), {}, settings);
  ASSERT_TRUE(trained) << trained.error().text();
  int covered = 0, all = 0;
  for (double t = -50; t <= 50; t += 5) {
    for (double u = 5.42; u < 5.59; u += 0.04, ++all) {
      const compensation::Prediction p = trained->model->predict(std::vector{t, u});
      EXPECT_GT(p.sd_deg_per_h, 0);
      covered += std::fabs(p.bias_deg_per_h - truth(t, u)) < 2 * p.sd_deg_per_h;
    }
  }
  EXPECT_GT(covered, 0.85 * all);
}

TEST(Trainer, TheGuardDetectsGapsInTheData) {
  TrainingSettings settings;
  settings.c = 300, settings.sigma2 = 0.05;
  settings.method = find_method("lssvm");
  TrainingData data = drift(400, false);
  const auto trained = train(data, {}, settings);
  ASSERT_TRUE(trained);
  int flagged = 0;
  for (Eigen::Index i = 0; i < 400; ++i)
    flagged += trained->model->predict(std::vector{data.inputs(0, i), data.inputs(1, i)}).extrapolating;
  EXPECT_LT(flagged, 12);
  EXPECT_TRUE(trained->model->predict(std::vector{200.0, 5.5}).extrapolating);  // outside the box
  EXPECT_TRUE(trained->model->predict(std::vector{0.0, 5.9}).extrapolating);
}

TEST(Trainer, LongRecordsBecomeSparseModelsWithEqualPredictions) {
  TrainingSettings settings;
  settings.method = find_method("ir-lssvm");
  settings.c = 1000, settings.sigma2 = 0.5;
  const auto sparse = train(drift(6000), {}, settings);
  ASSERT_TRUE(sparse) << sparse.error().text();
  EXPECT_EQ(sparse->model->info().kind, "sparse_lssvm");
  EXPECT_LT(sparse->centres, 400);
  EXPECT_LT(worst_error(*sparse->model), 0.0005);
  const compensation::Prediction near = sparse->model->predict(std::vector{0.0, 5.5}),
                                 far = sparse->model->predict(std::vector{0.0, 7.5});
  EXPECT_GT(near.sd_deg_per_h, 0);
  EXPECT_GT(far.sd_deg_per_h, 1.5 * near.sd_deg_per_h);
  EXPECT_TRUE(far.extrapolating);
  const auto read = compensation::parse_model(compensation::format_model(*sparse->model), "sparse.json");
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ((*read)->predict(std::vector{0.0, 5.5}).sd_deg_per_h, near.sd_deg_per_h);
}

TEST(Trainer, SupportVectorRegressionFindsTheDrift) {
  TrainingSettings settings;
  settings.method = find_method("svr");
  settings.c = 30, settings.sigma2 = 0.5, settings.epsilon = 0.05;
  const auto trained = train(drift(300, false), {}, settings);
  ASSERT_TRUE(trained) << trained.error().text();
  EXPECT_LT(worst_error(*trained->model), 0.003);
  EXPECT_LT(trained->centres, 300);
  EXPECT_EQ(trained->model->predict(std::vector{0.0, 5.5}).bias_deg_per_h,
            trained->model->predict(std::vector{0.0, 5.5}).bias_deg_per_h);
  EXPECT_GT(trained->model->predict(std::vector{0.0, 5.5}).sd_deg_per_h, 0);
}

TEST(Trainer, StepwiseFindsTheSimulatedTerms) {
  TrainingData data = drift(300, false);
  data.target = (0.1 + 0.002 * data.inputs.row(0).array() - 1e-5 * data.inputs.row(0).array().square()).transpose();
  for (Eigen::Index i = 0; i < 300; ++i) data.target[i] += 1e-4 * std::sin(777.0 * static_cast<double>(i));
  TrainingSettings settings;
  settings.method = find_method("stepwise");
  settings.terms = second_order_terms(2);
  const auto trained = train(data, {}, settings);
  ASSERT_TRUE(trained) << trained.error().text();
  std::vector<std::string> names;
  for (const int term : trained->polynomial->terms)
    names.push_back(term_name(settings.terms[static_cast<std::size_t>(term)], data.names));
  EXPECT_EQ(std::vector(names.begin(), names.begin() + 2), (std::vector<std::string>{"T", "T^2"}));
  EXPECT_NEAR(trained->model->predict(std::vector{40.0, 5.5}).bias_deg_per_h, 0.1 + 0.08 - 0.016, 1e-4);
}

TEST(Trainer, ReportsUnusableInput) {
  TrainingSettings settings;
  TrainingData still = drift(100);
  still.inputs.row(0).setConstant(25.1);
  EXPECT_EQ(train(still, {}, settings).error().text(), "T: the input is constant, expected one that changes");
  TrainingData hole = drift(100);
  hole.target[3] = std::nan("");
  EXPECT_EQ(train(hole, {}, settings).error().text(), "training data: found a number that is not finite");
  settings.c = 3;
  EXPECT_EQ(train(drift(100), {}, settings).error().text(), "c and sigma2: found one of them, expected both or none");
}

TEST(ResourcePlan, RejectsTooLargeTrainingsBeforeTheyStart) {
  TrainingSettings settings;
  settings.method = find_method("ir-lssvm");
  const auto fits = plan_resources(100000, 3, settings);
  ASSERT_TRUE(fits);
  EXPECT_TRUE(fits->sparse);
  EXPECT_LT(fits->bytes, 1e9);
  const auto huge = plan_resources(10'000'000, 3, settings);
  ASSERT_FALSE(huge);
  EXPECT_NE(huge.error().text().find("use fewer samples"), std::string::npos);
  settings.method = find_method("svr");
  EXPECT_FALSE(plan_resources(100000, 3, settings));
}

TEST(Methods, HaveCompleteRowsUnderTheirOwnNames) {
  for (const Method& method : methods()) {
    EXPECT_EQ(find_method(method.name), &method);
    EXPECT_TRUE(method.plan && method.train) << method.name;
  }
  EXPECT_EQ(find_method("unknown"), nullptr);
}

TEST(Methods, AreListedByWhatTheyUse) {
  EXPECT_EQ(method_names(kTuning, " and "), "lssvm, ir-lssvm and svr");
  EXPECT_EQ(method_names(kSiblings, " or "), "composite");
}

}  // namespace
}  // namespace prism::training
