// SPDX-License-Identifier: MIT
// Every model type predicts its error in a new run; simulated runs with their own drift and white noise.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "compensation/composite_model.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/model_text.hpp"
#include "compensation/training/held_out.hpp"
#include "compensation/training/trainer.hpp"

namespace prism::training {
namespace {

constexpr double kWhite = 0.006, kWander = 0.005;  // deg/h
constexpr Eigen::Index kRows = 600;

// 0.02 tanh(T / 20) + a random walk with a memory of about 30 rows + noise.
TrainingData run(unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  TrainingData data{{"T"}, Eigen::MatrixXd(1, kRows), Eigen::VectorXd(kRows), {}, {}};
  double walk = kWander * normal(random);
  for (Eigen::Index i = 0; i < kRows; ++i) {
    const double t = 60 * std::sin(12.6 * static_cast<double>(i) / kRows);
    walk = 0.97 * walk + kWander * std::sqrt(1 - 0.97 * 0.97) * normal(random);
    data.inputs(0, i) = t;
    data.target[i] = 0.3 + 0.02 * std::tanh(t / 20) + walk + kWhite * normal(random);
  }
  return data;
}

TrainingSettings settings_of(std::string_view method) {
  TrainingSettings settings;
  settings.method = find_method(method);
  settings.terms = cubic_terms();
  if (method != "composite") settings.c = 30, settings.sigma2 = 0.5;
  return settings;
}

class SpreadOf : public testing::TestWithParam<const char*> {};

TEST_P(SpreadOf, ANewRunLiesWithinTwoOfTheStatedDeviations) {
  double covered = 0, rows = 0;
  for (const unsigned seed : {1u, 2u, 3u}) {
    const auto trained = train(run(10 * seed), {}, settings_of(GetParam()));
    ASSERT_TRUE(trained) << trained.error().text();
    const auto& spread = trained->model->info().spread;
    ASSERT_TRUE(spread);
    EXPECT_EQ(spread->blocks, 10);
    EXPECT_GT(spread->samples, kRows / 2);
    EXPECT_NEAR(spread->noise_deg_per_h, kWhite, 0.15 * kWhite);
    const TrainingData next = run(10 * seed + 1);
    for (Eigen::Index i = 0; i < kRows; ++i, ++rows) {
      const auto p = compensation::predict_within(*trained->model, {next.inputs.col(i).data(), 1}, {});
      EXPECT_GT(p.sd_mean_deg_per_h, p.sd_deg_per_h);
      covered += std::fabs(next.target[i] - p.bias_deg_per_h) < 2 * p.sd_mean_deg_per_h;
    }
  }
  EXPECT_GT(covered / rows, 0.92);
  EXPECT_LT(covered / rows, 0.995);
}

INSTANTIATE_TEST_SUITE_P(Kinds, SpreadOf, testing::Values("composite", "ls", "lssvm", "ir-lssvm", "svr"),
                         [](const auto& kind) {
                           std::string name = kind.param;
                           std::erase(name, '-');
                           return name;
                         });

TEST(BetweenRunError, IsPartOfTheFileAndOfTheId) {
  const auto trained = train(run(5), {}, settings_of("ls"));
  ASSERT_TRUE(trained);
  std::string text = compensation::format_model(*trained->model);
  const auto read = compensation::parse_model(text, "m.json");
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ((*read)->info().spread, trained->model->info().spread);
  const std::string key = "\"samples\": ";
  text.insert(text.find(key) + key.size(), "1");
  EXPECT_FALSE(compensation::parse_model(text, "m.json"));
}

TEST(BetweenRunError, AShortRecordHasNone) {
  TrainingData data = run(7);
  data.inputs = data.inputs.leftCols(30).eval();
  data.target = data.target.head(30).eval();
  const auto trained = train(data, {}, settings_of("ls"));
  ASSERT_TRUE(trained);
  EXPECT_FALSE(trained->model->info().spread);
  EXPECT_TRUE(std::isnan(trained->model->predict(std::vector{1.0}).sd_mean_deg_per_h));
}

TEST(BetweenRunError, ThreeRecordingsAreHeldOutOneByOne) {
  std::vector<int> recordings(90, 0);
  std::fill(recordings.begin() + 45, recordings.end(), 1);
  EXPECT_EQ(fold_count(held_out_folds(recordings)), 10);
  std::fill(recordings.begin() + 70, recordings.end(), 2);
  EXPECT_EQ(held_out_folds(recordings), recordings);
}

// The variance that the record cannot distinguish from beta: the level of its nuisance, 1 / 1ᵀq⁻¹1, by matrix
// inversion.
TEST(NuisanceLevel, IsTheVarianceOfTheBestLinearEstimateOfTheLevel) {
  compensation::CompositeVariances v;
  v.nuisance = 0.7, v.nuisance_time_h = 3;
  Eigen::VectorXd time(40);
  for (Eigen::Index i = 0; i < 40; ++i) time[i] = 0.1 * static_cast<double>(i) + (i > 25 ? 2 : 0);
  const std::vector<int> one(40, 0);
  const Eigen::MatrixXd q = compensation::nuisance_matrix(v, time, one);
  EXPECT_NEAR(compensation::nuisance_level(v, time, one), 1 / q.inverse().sum(), 1e-9);
  std::vector<int> two = one;
  two.back() = 1;
  EXPECT_EQ(compensation::nuisance_level(v, time, two), 0);
}

}  // namespace
}  // namespace prism::training
