// SPDX-License-Identifier: MIT
// The expected sd: equal to what a composite model with the same covariance states.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "compensation/extrapolation.hpp"
#include "compensation/training/composite.hpp"
#include "compensation/training/held_out.hpp"
#include "compensation/training/trainer.hpp"
#include "tests/unit/design/stated_gyro.hpp"
#include "tests/unit/prismcal/simulated_day.hpp"
#include "tools/prismcal/plan.hpp"

namespace prism::design {
namespace {

TEST(DesignPosterior, ExpectsTheSdThatTheModelStates) {
  const KnownGyro known = gyro();
  const RecordedInputs recorded = cycle(0);
  auto posterior = DesignPosterior::make(known, domain(), recorded.inputs, 8);
  ASSERT_TRUE(posterior) << posterior.error().text();
  EXPECT_DOUBLE_EQ(posterior->sd_deg_per_h(), kScale_deg_per_h);  // without a recording
  const double expected = posterior->sd_with(recorded);
  posterior->add(recorded);
  EXPECT_DOUBLE_EQ(posterior->sd_deg_per_h(), expected);
  const auto model = model_of(known, recorded);
  const Eigen::VectorXd sd = posterior->sd_at_points();
  for (Eigen::Index i = 0; i < sd.size(); ++i) {
    const Eigen::VectorXd x = domain().col(i);
    const double stated =
        compensation::predict_within(*model, {x.data(), 2}, compensation::Extrapolation::kPreset).sd_deg_per_h;
    // The pivots leave 2 % of the noise's variance; the offset is known to the design, not to the model.
    EXPECT_NEAR(sd[i], stated, 0.03 * stated) << i;
  }
}

TEST(DesignPosterior, FurtherRecordingsAddInformation) {
  auto posterior = DesignPosterior::make(gyro(), domain(), domain(), 8);
  posterior->add(cycle(0));
  const double one = posterior->sd_deg_per_h(), with_same = posterior->sd_with(cycle(0));
  EXPECT_LT(with_same, one);
  RecordedInputs soak = cycle(0);
  soak.inputs.colwise() = Eigen::Vector2d(-25, 0);
  EXPECT_LT(posterior->sd_with(soak), one);
  EXPECT_GT(posterior->sd_with(soak), with_same);  // one temperature only
  // Rows that are means of three windows are worth almost the same.
  RecordedInputs thin = cycle(0);
  thin.inputs = cycle(0).inputs(Eigen::all, Eigen::seq(1, 119, 3)).eval();
  thin.time_h = cycle(0).time_h(Eigen::seq(1, 119, 3)).eval();
  EXPECT_NEAR(posterior->sd_with(thin, 3), with_same, 0.03 * with_same);
}

// A run differs from the mean of R runs by D (1 + 1/R) / 2, D the variance of the difference between two.
TEST(DesignPosterior, TheDifferenceBetweenRunsFallsToAHalf) {
  KnownGyro known = gyro();
  known.variances.kernel.rbf = 1e-9;  // nothing to learn: the sd is that of the runs
  known.variances.kernel.linear = known.variances.kernel.quadratic = 1e-9;
  known.variances.noise = 1e-6;
  const double level = compensation::nuisance_level(known.variances, cycle(0).time_h, std::vector<int>(120, 0));
  const double drift = known.variances.nuisance - level;
  const double two_runs = std::pow(compensation::kAssumedOffset, 2) + training::kDaysDiffer * drift;
  auto posterior = DesignPosterior::make(known, domain(), domain(), 8);
  for (int runs = 1; runs <= 16; ++runs) {
    posterior->add(cycle(0));
    const double variance = 1.25 * drift + two_runs * (1 + 1.0 / runs) / 2;
    EXPECT_NEAR(posterior->sd_deg_per_h(), kScale_deg_per_h * std::sqrt(variance),
                0.02 * kScale_deg_per_h * std::sqrt(variance))
        << runs;
  }
}

// Of a long record the model keeps a few centres and what they know.
TEST(DesignPosterior, ContinuesALongRecord) {
  const KnownGyro known = gyro();
  const RecordedInputs recorded = cycle(0);
  const auto dense = model_of(known, recorded);
  auto p = dynamic_cast<const compensation::CompositeModel&>(*dense).parameters();
  const compensation::CompositeVariances variances = p.variances;
  p.centres = p.centres(Eigen::all, Eigen::seq(0, 119, 2)).eval();
  p.alpha = Eigen::VectorXd::Zero(p.centres.cols());
  Eigen::MatrixXd kernel = variances.kernel.matrix(p.centres);
  kernel.diagonal().array() += compensation::kCompositeJitter * variances.kernel.rbf;
  const Eigen::LLT<Eigen::MatrixXd> factor(kernel);
  const compensation::CompositeCentres centres(variances.kernel, p.centres);
  const Eigen::MatrixXd x = training::normalised_inputs(recorded.inputs, known.normalisation);
  Eigen::MatrixXd psi(p.centres.cols() + 1, x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) psi.col(i) << factor.matrixL().solve(centres.row(x.col(i))), 1.0;
  const training::NuisanceFilter filter(variances, p.time_h, p.recording, p.weight);
  training::NuisanceFilter::Carry carry(psi.rows());
  filter.whiten(psi, 0, carry);
  p.gram = psi * psi.transpose();
  p.gram.diagonal().head(p.centres.cols()).array() += 1;
  p.weight.resize(0);
  p.time_h.resize(0);
  p.recording.clear();
  const auto model = compensation::CompositeModel::make(dense->info(), p);
  ASSERT_TRUE(model) << model.error().text();
  auto long_record = known_gyro(*model);
  ASSERT_TRUE(long_record) << long_record.error().text();
  auto posterior = DesignPosterior::make(*long_record, domain(), domain(), 0);
  ASSERT_TRUE(posterior) << posterior.error().text();
  posterior->add_long_record();
  const Eigen::VectorXd sd = posterior->sd_at_points();
  for (Eigen::Index i = 0; i < sd.size(); ++i) {
    const Eigen::VectorXd at = domain().col(i);
    const double stated =
        compensation::predict_within(**model, {at.data(), 2}, compensation::Extrapolation::kPreset).sd_deg_per_h;
    EXPECT_NEAR(sd[i], stated, 0.01 * stated) << i;
  }
}

TEST(KnownGyro, ContainsTheRecordingsOfAModel) {
  const auto known = known_gyro(model_of(gyro(), cycle(0)));
  ASSERT_TRUE(known) << known.error().text();
  ASSERT_EQ(known->recordings.size(), 1U);
  EXPECT_LT((known->recordings[0].inputs - cycle(0).inputs).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(known_gyro(test::linear_model(1e-4)).error().text(),
            "line: found a model of type polynomial, expected composite, made by prismcal train");
}

}  // namespace
}  // namespace prism::design
