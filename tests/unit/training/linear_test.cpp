// SPDX-License-Identifier: MIT
// Cubic least squares and stepwise regression, compared with 60-digit arithmetic.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "compensation/training/polynomial.hpp"
#include "tests/unit/training/golden.hpp"

namespace prism::training {
namespace {

using test::relative;

constexpr double kCoefficientTolerance = 1e-9;

void expect_result(const PolynomialFit& found, const nlohmann::json& expected, const std::vector<std::string>& names) {
  const auto name = [&](int term) { return names[static_cast<std::size_t>(term)]; };
  ASSERT_EQ(found.path.size(), expected["path"].size());
  for (std::size_t i = 0; i < found.path.size(); ++i) {
    const StepwiseStep& step = found.path[i];
    const nlohmann::json& wanted = expected["path"][i];
    EXPECT_EQ(step.action, wanted["action"].get<std::string>());
    std::set<std::string> terms;
    for (const int term : step.terms) terms.insert(name(term));
    EXPECT_EQ(terms, wanted["terms"].get<std::set<std::string>>()) << "step " << i;
    EXPECT_EQ(step.terms.size(), wanted["terms"].size());
    if (!wanted.contains("term")) continue;
    EXPECT_EQ(name(step.term), wanted["term"].get<std::string>());
    EXPECT_LT(relative(step.p, wanted["p"]), 1e-7);
    EXPECT_NEAR(std::fabs(step.t), std::fabs(wanted["t"].get<double>()), 1e-9 * std::fabs(step.t) + 1e-9);
  }
  EXPECT_EQ(found.terms.size(), expected["final_terms"].size());
  EXPECT_LT(relative(found.fit.intercept, expected["intercept"]), kCoefficientTolerance);
  EXPECT_LT(relative(found.fit.sse, expected["sse"]), kCoefficientTolerance);
  EXPECT_EQ(found.fit.df, expected["df"]);
  for (std::size_t i = 0; i < found.terms.size(); ++i) {
    const double coefficient = found.fit.coefficient[static_cast<Eigen::Index>(i)],
                 t = found.fit.t[static_cast<Eigen::Index>(i)];
    EXPECT_LT(relative(coefficient, expected["coef"][name(found.terms[i])]), kCoefficientTolerance);
    EXPECT_LT(relative(coefficient / t, expected["se"][name(found.terms[i])]), kCoefficientTolerance);
  }
}

std::vector<int> positions(const nlohmann::json& wanted, const std::vector<std::string>& names) {
  std::vector<int> at;
  for (const std::string name : wanted)
    at.push_back(static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin()));
  return at;
}

TEST(Stepwise, FollowsTheReferenceInEveryRandomProblem) {
  const auto dir = test::golden_dir("stepwise");
  const auto all = nlohmann::json::parse(test::read_file(dir / "golden.json"));
  ASSERT_GE(all.size(), 8u);
  for (const auto& expected : all) {
    SCOPED_TRACE(expected["id"].get<std::string>());
    test::Columns data = test::read_columns(dir / (expected["id"].get<std::string>() + ".csv"));
    const auto names = expected["candidates"].get<std::vector<std::string>>();
    Eigen::MatrixXd columns(data["y"].size(), names.size());
    for (std::size_t j = 0; j < names.size(); ++j)
      columns.col(static_cast<Eigen::Index>(j)) = test::vector_of(data[names[j]]);
    const auto found =
        fit_stepwise(columns, test::vector_of(data["y"]), {positions(expected["initial"], names), 0.05, 0.10});
    ASSERT_TRUE(found) << found.error().text();
    expect_result(*found, expected, names);
  }
}

// The value of the term "T", "T^2" or "T*R".
Eigen::VectorXd term_column(const std::string& name, test::Columns& data) {
  if (name.find("^2") != std::string::npos) return test::vector_of(data[name.substr(0, 1)]).cwiseAbs2();
  if (name.size() == 3)
    return test::vector_of(data[name.substr(0, 1)]).cwiseProduct(test::vector_of(data[name.substr(2, 1)]));
  return test::vector_of(data[name]);
}

TEST(Stepwise, FindsThePapersTwoModels) {
  const auto dir = test::golden_dir("gyro924");
  const auto all = nlohmann::json::parse(test::read_file(dir / "linear_models.json"))["stepwise"];
  test::Columns data = test::read_columns(dir / "train.csv");
  for (const char* model : {"model1", "model2"}) {
    SCOPED_TRACE(model);
    const auto names = all[model]["candidates"].get<std::vector<std::string>>();
    Eigen::MatrixXd columns(data["y"].size(), names.size());
    for (std::size_t j = 0; j < names.size(); ++j)
      columns.col(static_cast<Eigen::Index>(j)) = term_column(names[j], data);
    const auto found =
        fit_stepwise(columns, test::vector_of(data["y"]), {positions(all[model]["initial"], names), 0.05, 0.10});
    ASSERT_TRUE(found) << found.error().text();
    expect_result(*found, all[model], names);
  }
}

TEST(LeastSquares, CubicFitsEqualTheReference) {
  const auto dir = test::golden_dir("gyro924");
  const auto cubic = nlohmann::json::parse(test::read_file(dir / "linear_models.json"))["cubic"];
  test::Columns data = test::read_columns(dir / "train.csv");
  for (const char* input : {"T", "R", "U"}) {
    const Eigen::ArrayXd x = test::vector_of(data[input]).array();
    Eigen::MatrixXd columns(x.size(), 3);
    columns << x.matrix(), x.square().matrix(), x.cube().matrix();
    const LinearProblem problem(columns, test::vector_of(data["y"]));
    const auto fit = problem.fit({0, 1, 2});
    ASSERT_TRUE(fit);
    EXPECT_LT(relative(fit->intercept, cubic[input]["k"][0]), kCoefficientTolerance);
    for (int j = 0; j < 3; ++j)
      EXPECT_LT(relative(fit->coefficient[j], cubic[input]["k"][j + 1]), kCoefficientTolerance);
    EXPECT_LT(relative(fit->sse, cubic[input]["sse"]), 1e-12);
    EXPECT_GT(problem.condition({0, 1, 2}), 1);
  }
}

TEST(LeastSquares, FewSamplesHaveTheirDegreesOfFreedom) {
  Eigen::MatrixXd columns(3, 3);
  columns << 0, 0, 1, 1, 1, 0, 2, 4, 7;
  const LinearProblem problem(columns, Eigen::Vector3d(1, 2, 6));
  const LinearFit mean = problem.fit({}).value(), line = problem.fit({0}).value(), exact = problem.fit({0, 1}).value();
  EXPECT_DOUBLE_EQ(mean.intercept, 3);
  EXPECT_DOUBLE_EQ(mean.sse, 14);
  EXPECT_EQ(mean.df, 2);
  EXPECT_DOUBLE_EQ(mean.sd(), std::sqrt(7.0));
  EXPECT_DOUBLE_EQ(line.intercept, 0.5);
  EXPECT_DOUBLE_EQ(line.coefficient[0], 2.5);
  EXPECT_DOUBLE_EQ(line.sse, 1.5);  // residuals 0.5, −1, 0.5
  EXPECT_DOUBLE_EQ(line.t[0], 2.5 / std::sqrt(1.5 / 2));
  EXPECT_NEAR(line.p[0], 1 - 2 / M_PI * std::atan(line.t[0]), 1e-12);  // Cauchy: one degree of freedom
  EXPECT_EQ(exact.df, 0);
  EXPECT_EQ(exact.sd(), 0);
  EXPECT_EQ(exact.p[1], 1);
  EXPECT_TRUE(std::isinf(exact.t[1]));
  EXPECT_NEAR(exact.coefficient[1], 1.5, 1e-12);
  EXPECT_EQ(problem.fit({0, 1, 2}).error().text(), "least squares: found 3 samples, expected more than 3 terms");
  EXPECT_TRUE(fit_stepwise(columns.leftCols(1), Eigen::Vector3d(1, 2, 6), {}));
  EXPECT_EQ(fit_stepwise(columns.topRows(2), Eigen::Vector2d(1, 2), {}).error().text(),
            "stepwise: found 2 samples, expected at least 3");
}

// Columns with a known angle: two unit vectors and an intercept orthogonal to both; singular values √(1 ± cos).
TEST(LeastSquares, TheConditionNumberIsThatOfTheScaledDesign) {
  Eigen::MatrixXd columns(4, 2);
  columns << 1, 1, -1, -1, 0, 1, 0, -1;
  const double cosine = 2 / std::sqrt(2.0 * 4.0);
  const LinearProblem problem(columns, Eigen::VectorXd::LinSpaced(4, 0, 1));
  EXPECT_NEAR(problem.condition({0, 1}), std::sqrt((1 + cosine) / (1 - cosine)), 1e-12);
}

TEST(LeastSquares, RejectsDependentColumnsAndThresholdsOutOfOrder) {
  Eigen::MatrixXd columns(5, 2);
  columns << 1, 3, 2, 5, 3, 7, 4, 9, 5, 11;
  const Eigen::VectorXd y = Eigen::VectorXd::LinSpaced(5, 0, 1);
  const LinearProblem dependent(columns, y);
  EXPECT_EQ(dependent.fit({0, 1}).error().text(), "least squares: term 2 depends on the others");
  EXPECT_EQ(dependent.fit({1, 0}).error().text(), "least squares: term 1 depends on the others");
  // The mean of many equal numbers is rounded; the differences from it must not count as a slope.
  for (const Eigen::Index n : {4099, 5003, 7001}) {
    const LinearProblem constant(Eigen::VectorXd::Constant(n, 1e15 / 3), Eigen::VectorXd::LinSpaced(n, 0, 1));
    EXPECT_FALSE(constant.fit({0})) << n;
    const LinearProblem level(Eigen::VectorXd::LinSpaced(n, 0, 1), Eigen::VectorXd::Constant(n, 1e15 / 3));
    EXPECT_EQ(level.fit({})->sse, 0) << n;
    EXPECT_EQ(level.fit({0})->coefficient[0], 0) << n;
  }
  columns.col(1).setConstant(0.1);
  EXPECT_FALSE(LinearProblem(columns, y).fit({1}));
  EXPECT_EQ(fit_stepwise(y, Eigen::VectorXd::Ones(5), {{}, 0.2, 0.1}).error().text(),
            "stepwise: found p-enter 0.2 and p-remove 0.1, expected 0 < p-enter <= p-remove <= 1");
  EXPECT_FALSE(fit_stepwise(y, y, {{}, 0, 0.1}));
  EXPECT_FALSE(fit_stepwise(y, y, {{}, 0.1, 1.1}));
  EXPECT_TRUE(fit_stepwise(y, Eigen::VectorXd::LinSpaced(5, 0, 1).cwiseAbs2(), {{}, 1, 1}));
}

}  // namespace
}  // namespace prism::training
