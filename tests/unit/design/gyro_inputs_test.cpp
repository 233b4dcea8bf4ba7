// SPDX-License-Identifier: MIT
// Inputs of a profile: equal to those of the simulated gyro.
#include "tools/prismcal/design/gyro_inputs.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tools/prismsim/simulation/simulated_gyro.hpp"

namespace prism::design {
namespace {

const simulation::ChamberProfile kProfile{"test", 25, {{3600, -40}, {7200, -40}, {3600, 60}, {3600, 60}}};

TEST(GyroInputs, FollowTheSimulatedGyro) {
  compensation::FeatureDefinition features;
  features.lag_time_constants_s = {1800};
  const auto inputs = GyroInputs::make({"T", "dTdt", "lag1"}, features, {}, {});
  ASSERT_TRUE(inputs) << inputs.error().text();
  const RecordedInputs recorded = inputs->on(kProfile);
  ASSERT_EQ(recorded.inputs.cols(), 180);
  simulation::SimulatedGyro gyro(kProfile, 1);
  double mean = 0, before = gyro.truth().body_degc, lagged = before;
  for (Eigen::Index i = 0; i < recorded.inputs.cols(); ++i) {
    mean = 0;
    for (int s = 0; s < 100; ++s) {
      const double body = gyro.step(1).body_degc;
      mean += body / 100;
      lagged -= (body - lagged) * std::expm1(-1.0 / 1800);
    }
    const double body = gyro.truth().body_degc;
    EXPECT_NEAR(recorded.inputs(0, i), mean, 0.1) << i;  // the mean of both ends, in steps of 10 s
    EXPECT_NEAR(recorded.inputs(1, i), (body - before) / 100, 2e-4) << i;
    EXPECT_NEAR(recorded.inputs(2, i), body - lagged, 0.1) << i;
    EXPECT_NEAR(recorded.time_h[i], static_cast<double>(i + 1) / 36, 1e-9);
    before = body;
  }
}

TEST(GyroInputs, WithoutLagTheGyroIsAtTheChamber) {
  const auto inputs = GyroInputs::make({"T"}, {}, {0, 0}, {});
  const RecordedInputs recorded = inputs->on({"soak", 25, {{1000, 25}}}, 2);
  ASSERT_EQ(recorded.inputs.cols(), 5);
  EXPECT_EQ(recorded.inputs(0, 4), 25);
}

TEST(GyroInputs, OtherInputsFollowTheTemperatureAsRecorded) {
  RecordedInputs recorded;
  recorded.inputs.resize(2, 100);
  recorded.time_h = Eigen::VectorXd::LinSpaced(100, 0, 3);
  recorded.inputs.row(0) = Eigen::RowVectorXd::LinSpaced(100, -20, 50);
  recorded.inputs.row(1) = 5.4 - 0.003 * recorded.inputs.row(0).array();
  const auto inputs = GyroInputs::make({"T", "U"}, {}, {}, {recorded});
  ASSERT_TRUE(inputs) << inputs.error().text();
  const Eigen::MatrixXd x = inputs->on(kProfile).inputs;
  for (Eigen::Index i = 0; i < x.cols(); ++i) EXPECT_NEAR(x(1, i), 5.4 - 0.003 * x(0, i), 0.01) << i;
  const auto points = inputs->over({{"T", -10, 40}}, 50);
  ASSERT_TRUE(points);
  EXPECT_GE(points->row(0).minCoeff(), -10);
  EXPECT_LE(points->row(0).maxCoeff(), 40);
  EXPECT_GT(points->row(0).maxCoeff() - points->row(0).minCoeff(), 45);
}

TEST(GyroInputs, NameWhatIsMissing) {
  EXPECT_EQ(GyroInputs::make({"dTdt"}, {}, {}, {}).error().text(), "inputs: found dTdt, expected T among them");
  EXPECT_EQ(
      GyroInputs::make({"T", "U"}, {}, {}, {}).error().text(),
      "inputs: U does not follow from the chamber's temperature: design needs a model with its recordings, or --prior");
  const auto inputs = GyroInputs::make({"T"}, {}, {}, {});
  EXPECT_EQ(inputs->over({{"dTdt", 0, 1}}, 5).error().text(), "--domain: found dTdt, expected inputs of the model: T");
  EXPECT_EQ(inputs->over({}, 5).error().text(), "--domain: found no range of T, expected one");
}

}  // namespace
}  // namespace prism::design
