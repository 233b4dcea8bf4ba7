// SPDX-License-Identifier: MIT
// The choice of inputs: the smallest set that predicts.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tools/prismcal/training_set.hpp"

namespace prism::recordings {
namespace {

/// Approximately normal, and the same on every machine.
class Noise {
 public:
  explicit Noise(unsigned seed) : random_(seed) {}
  double operator()() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += static_cast<double>(random_()) / 4294967295.0;
    return sum;
  }

 private:
  std::mt19937 random_;
};

/// Slow changes; the target depends on T and on the case's difference, with noise; "twin" is case-T; "still" is
/// constant; "other" is independent.
training::TrainingData record(double noise, int samples = 400) {
  Noise noise_of(5);
  training::TrainingData data;
  data.names = {"T", "dTdt", "case-T", "twin", "still", "other"};
  data.inputs.resize(6, samples);
  data.target.resize(samples);
  for (Eigen::Index i = 0; i < samples; ++i) {
    const double time = static_cast<double>(i);
    const double t = 30 * std::sin(time / 60), gradient = 4 * std::sin(time / 17 + 1);
    data.inputs.col(i) << t, 0.5 * std::cos(time / 60), gradient, gradient, 7, std::sin(time / 29);
    data.target[i] = 0.01 + 0.001 * t + 1e-5 * t * t + 0.004 * gradient + noise * noise_of();
  }
  return data;
}

TEST(InputSearch, SelectsOnlyInputsThatPredict) {
  const auto search = search_inputs(record(0.002));
  ASSERT_TRUE(search) << search.error().text();
  EXPECT_EQ(search->best().inputs.size(), 2u);
  EXPECT_EQ(search->best().inputs.front(), "T");
  EXPECT_NEAR(search->best().error_deg_per_h, 0.002, 0.0004);
  EXPECT_GT(search->without_deg_per_h, 0.02);
  EXPECT_EQ(search->alone.size(), 5u) << "a constant input is not a candidate";
  for (std::size_t i = 1; i < search->path.size(); ++i)
    EXPECT_EQ(search->path[i].inputs.size(), search->path[i - 1].inputs.size() + 1);
}

TEST(InputSearch, SelectsOneInputIfNoInputPredicts) {
  training::TrainingData data = record(0.002);
  Noise noise_of(9);
  for (double& value : data.target) value = noise_of();
  const auto search = search_inputs(data);
  ASSERT_TRUE(search);
  EXPECT_EQ(search->best().inputs.size(), 1u);
  EXPECT_GT(search->best().error_deg_per_h, 0.9);
}

TEST(InputSearch, RejectsTooFewSamplesAndConstantInputs) {
  EXPECT_EQ(search_inputs(record(0.002, 39)).error().text(),
            "inputs: found 39 samples, expected at least 40 to choose inputs by");
  training::TrainingData still = record(0.002);
  still.inputs.setConstant(3);
  EXPECT_EQ(search_inputs(still).error().text(), "inputs: found only constant inputs, expected one that changes");
}

}  // namespace
}  // namespace prism::recordings
