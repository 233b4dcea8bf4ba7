// SPDX-License-Identifier: MIT
// The cases of tests/golden, and of the full set in ../shared if it exists: LSSVM and IR-LSSVM compared with
// LS-SVMlab's conventions in extended precision.
//
// Tolerance: max(1e-10, 1e-14 · cond), the law of double arithmetic that the reference's README measured.
#include "tests/unit/training/golden.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "compensation/kernel.hpp"
#include "compensation/training/lssvm.hpp"
#include "compensation/training/trainer.hpp"

namespace prism::training {
namespace {

using test::Golden;
using test::relative;

class GoldenCase : public testing::TestWithParam<test::GoldenName> {
 protected:
  void SetUp() override {
    golden_.emplace(GetParam().name, GetParam().id);
    kernel_ = compensation::kernel_matrix(golden_->x, golden_->sigma2);
  }
  LssvmFactor factor() {
    return *LssvmFactor::make(kernel_, Eigen::VectorXd::Constant(golden_->y.size(), 1 / golden_->c), golden_->y);
  }
  std::optional<Golden> golden_;
  Eigen::MatrixXd kernel_;
};

INSTANTIATE_TEST_SUITE_P(Shared, GoldenCase, testing::ValuesIn(test::golden_names()),
                         [](const auto& golden) { return golden.param.name + "_" + golden.param.id; });

TEST_P(GoldenCase, NormalisesLikeTheReference) {
  Golden& g = *golden_;
  const std::string rule = g.about["preprocess"];
  const NormalisationMethod scaling = rule == "zscore"     ? NormalisationMethod::kZscore
                                      : rule == "original" ? NormalisationMethod::kNone
                                                           : NormalisationMethod::kAuto;
  const auto data = normalise({g.about["inputs"], g.inputs(g.train), test::vector_of(g.train["y"]), {}, {}}, scaling);
  ASSERT_TRUE(data) << data.error().text();
  EXPECT_LT((data->x - g.x).cwiseAbs().maxCoeff(), 1e-14 * std::max(1.0, g.x.cwiseAbs().maxCoeff()));
  EXPECT_LT((data->y - g.y).cwiseAbs().maxCoeff(), 1e-14 * std::max(1.0, g.y.cwiseAbs().maxCoeff()));
}

TEST_P(GoldenCase, TheUnweightedModelIsTheReferences) {
  Golden& g = *golden_;
  const LssvmFactor f = factor();
  const auto& expected = g.expected["unweighted"];
  EXPECT_LT(relative(g.kept(f.solution().alpha), g.column("alpha")), g.tolerance);
  EXPECT_LT(relative(f.solution().b, expected["b"]), g.tolerance);
  const Eigen::VectorXd residual = f.solution().alpha / g.c;
  EXPECT_LT(relative(g.kept(residual), g.column("resid")), g.tolerance);
  const Eigen::VectorXd predicted = g.predict(f.solution().alpha, f.solution().b);
  EXPECT_LT((predicted - test::vector_of(g.test_expected["pred_unweighted"])).cwiseAbs().maxCoeff() / g.scale,
            g.tolerance);
  EXPECT_LT(relative(robust_scale(residual, ScaleKind::kMad), expected["s_mad"]), g.tolerance);
  EXPECT_LT(relative(robust_scale(residual, ScaleKind::kIqr), expected["s_iqr_hazen"]), g.tolerance);
}

TEST_P(GoldenCase, HeldOutResidualsComeFromOneFactorisation) {
  Golden& g = *golden_;
  const auto& expected = g.expected["unweighted"];
  const auto loo = cross_validate(kernel_, g.y, g.c, {}, g.scale);
  ASSERT_TRUE(loo);
  EXPECT_LT(relative(g.kept(loo->residual), g.column("loo_resid_orig")), g.tolerance);
  EXPECT_LT(relative(loo->mse, expected["loo_mse"]), g.tolerance);
  EXPECT_LT(relative(loo->mae, expected["loo_mae"]), g.tolerance);
  const auto cv = cross_validate(kernel_, g.y, g.c, g.folds, g.scale);
  ASSERT_TRUE(cv);
  const Eigen::VectorXd held_out = g.kept(test::vector_of(g.train["y"])) - g.column("cv_pred_orig");
  EXPECT_LT(relative(g.kept(cv->residual), held_out), g.tolerance);
  EXPECT_LT(relative(cv->mse, expected["cv_mse"]), g.tolerance);
  EXPECT_LT(relative(cv->mae, expected["cv_mae"]), g.tolerance);
  for (std::size_t i = 0; i < cv->fold_mae.size(); ++i)
    EXPECT_LT(relative(cv->fold_mae[i], expected["fold_mae"][i]), g.tolerance);
}

// With extended-precision residuals the result does not depend on the machine: where plain double keeps four digits,
// the remaining difference is the uncertainty of the reference itself.
TEST_P(GoldenCase, RefiningRecoversTheDigitsThatDoubleLoses) {
  Golden& g = *golden_;
  const ExtendedMatrix extended = extended_kernel_matrix(g.x, g.sigma2);
  ReweightSettings settings;
  settings.extended = &extended;
  const LssvmSolution s = fit_irlssvm(kernel_, g.y, g.c, settings)->solution;
  const double tolerance = std::max(1e-13, 100 * g.expected["accuracy"]["alpha_rel"].get<double>());
  EXPECT_LT(relative(g.kept(s.alpha), g.column("alpha")), tolerance);
  EXPECT_LT(relative(s.b, g.expected["unweighted"]["b"]), tolerance);
}

class GoldenWeight : public testing::TestWithParam<std::tuple<test::GoldenName, WeightKind>> {
 protected:
  void SetUp() override {
    const test::GoldenName& name = std::get<0>(GetParam());
    golden_.emplace(name.name, name.id);
    kernel_ = compensation::kernel_matrix(golden_->x, golden_->sigma2);
    kind_ = std::get<1>(GetParam());
    weight_ = weight_name(kind_);
    settings_.weight = golden_->weight(kind_);
  }
  double prediction_error(const LssvmSolution& s, const std::string& column) {
    const Eigen::VectorXd found = golden_->predict(s.alpha, s.b);
    return (found - test::vector_of(golden_->test_expected[column])).cwiseAbs().maxCoeff() / golden_->scale;
  }
  std::optional<Golden> golden_;
  Eigen::MatrixXd kernel_;
  WeightKind kind_{};
  std::string weight_;
  ReweightSettings settings_;
};

INSTANTIATE_TEST_SUITE_P(Shared, GoldenWeight,
                         testing::Combine(testing::ValuesIn(test::golden_names()),
                                          testing::Values(WeightKind::kHuber, WeightKind::kHampel,
                                                          WeightKind::kLogistic, WeightKind::kMyriad)),
                         [](const auto& golden) {
                           const test::GoldenName& name = std::get<0>(golden.param);
                           return name.name + "_" + name.id + "_" + weight_name(std::get<1>(golden.param));
                         });

TEST_P(GoldenWeight, OneReweightingIsThePapersAlgorithm) {
  Golden& g = *golden_;
  settings_.limit = 1;
  const auto fit = fit_irlssvm(kernel_, g.y, g.c, settings_);
  ASSERT_TRUE(fit);
  EXPECT_LT(relative(fit->report.scale, g.expected["robust"][weight_]["onestep"]["s"]), g.tolerance);
  EXPECT_LT(relative(g.kept(fit->weight), g.column(weight_ + "_v1")), 10 * g.tolerance);  // v falls as u² at most
  EXPECT_LT(relative(g.kept(fit->solution.alpha), g.column(weight_ + "_alpha1")), 10 * g.tolerance);
  EXPECT_LT(prediction_error(fit->solution, "pred_" + weight_ + "_onestep"), g.tolerance);
}

TEST_P(GoldenWeight, ReweightingStopsWhereTheReferenceStops) {
  Golden& g = *golden_;
  const auto fit = fit_irlssvm(kernel_, g.y, g.c, settings_);
  ASSERT_TRUE(fit);
  const auto& expected = g.expected["robust"][weight_]["converged"];
  const double cond = g.expected["unweighted"]["cond_est"];
  EXPECT_FALSE(fit->report.oscillating);
  if (cond < 1e7) {
    EXPECT_EQ(fit->report.solves, expected["niter"]);
    EXPECT_EQ(fit->report.converged, expected["converged"]);
    EXPECT_LT(relative(g.kept(fit->solution.alpha), g.column(weight_ + "_alpha")), 10 * g.tolerance);
    EXPECT_LT(relative(g.kept(fit->weight), g.column(weight_ + "_v")), 10 * g.tolerance);
    EXPECT_LT(relative(fit->report.scale, expected["s_last"]), g.tolerance);
  }
  EXPECT_LT(prediction_error(fit->solution, "pred_" + weight_), g.tolerance);
}

TEST_P(GoldenWeight, RobustTenFoldCostIsTheReferences) {
  Golden& g = *golden_;
  const auto& expected = g.expected["robust"][weight_]["rcv10"];
  settings_.limit = 1;
  auto cv = cross_validate_robust(kernel_, g.y, g.c, settings_, g.folds, g.scale);
  ASSERT_TRUE(cv);
  EXPECT_LT(relative(cv->mae, expected["mae_onestep"]), g.tolerance);
  settings_.limit = kRobustSolves;
  settings_.tolerance = 0;
  // One fold of mcycle133 B never converges with Hampel's weights: 30 chaotic solves amplify 1e-14 to 1e-8.
  ExtendedMatrix extended;
  if (g.y.size() < 500) settings_.extended = &(extended = extended_kernel_matrix(g.x, g.sigma2));
  cv = cross_validate_robust(kernel_, g.y, g.c, settings_, g.folds, g.scale);
  ASSERT_TRUE(cv);
  EXPECT_LT(relative(cv->mae, expected["mae_30iter"]), g.tolerance);
  const Eigen::VectorXd held_out = g.kept(test::vector_of(g.train["y"])) - g.column(weight_ + "_rcv_pred_orig");
  EXPECT_LT(relative(g.kept(cv->residual), held_out), 10 * g.tolerance);
}

TEST_P(GoldenCase, AHampelWeightOfZeroDropsTheSample) {
  Golden& g = *golden_;
  ReweightSettings settings;
  settings.limit = 1;
  settings.weight = {WeightKind::kHampel, 0, 0.0};
  const auto fit = fit_irlssvm(kernel_, g.y, g.c, settings);
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->report.dropped, g.expected["robust"]["hampel"]["onestep_exact_zero"]["n_removed"]);
  EXPECT_LT(relative(g.kept(fit->solution.alpha), g.column("hampel0_alpha1")), 10 * g.tolerance);
  const Eigen::VectorXd fitted = kernel_ * fit->solution.alpha + Eigen::VectorXd::Constant(g.y.size(), fit->solution.b);
  EXPECT_LT((fit->residual - (g.y - fitted)).cwiseAbs().maxCoeff(), g.tolerance);
}

TEST(Lssvm, EqualPointsWithoutNoiseAreAnErrorOfEachFit) {
  const Eigen::MatrixXd kernel = Eigen::MatrixXd::Ones(4, 4);
  const Eigen::Vector4d y(1, 2, 3, 4);
  const std::string error =
      "LSSVM: the kernel matrix is not positive definite in double precision: c is too large for this sigma2";
  EXPECT_EQ(fit_irlssvm(kernel, y, 1e30, {}).error().text(), error);
  EXPECT_EQ(cross_validate(kernel, y, 1e30, {0, 0, 1, 1}, 1).error().text(), error);
  EXPECT_EQ(cross_validate_robust(kernel, y, 1e30, {}, {0, 0, 1, 1}, 1).error().text(), error);
  EXPECT_EQ(fit_irlssvm(Eigen::MatrixXd::Identity(1, 1), Eigen::VectorXd::Ones(1), 1, {}).error().text(),
            "IR-LSSVM: 1 of 1 samples have a weight, expected at least 2");
}

TEST(Lssvm, WeightsThatDoNotChangeEndTheReweighting) {
  ReweightSettings settings;
  settings.weight = {WeightKind::kHuber, 1e6, 0};
  settings.tolerance = 0;
  const Eigen::Vector4d y(1, 2, 3, 4);
  const auto fit = fit_irlssvm(Eigen::MatrixXd::Identity(4, 4), y, 10, settings);
  ASSERT_TRUE(fit);
  EXPECT_TRUE(fit->report.converged);
  EXPECT_EQ(fit->report.solves, 1);
}

}  // namespace
}  // namespace prism::training
