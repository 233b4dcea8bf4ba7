// SPDX-License-Identifier: MIT
// The search: as good as the independent one of the reference, the same on any number of threads, can be stopped.
#include "compensation/training/tuning.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <tuple>

#include "compensation/kernel.hpp"
#include "compensation/training/held_out.hpp"
#include "compensation/training/lssvm.hpp"
#include "compensation/training/minimise.hpp"
#include "tests/unit/training/golden.hpp"

namespace prism::training {
namespace {

TEST(Simplex, FindsTheMinimumOfRosenbrockAndStaysInItsBox) {
  int evaluations = 0;
  const auto f = [&](const Eigen::VectorXd& x) {
    ++evaluations;
    return 100 * std::pow(x[1] - x[0] * x[0], 2) + std::pow(1 - x[0], 2);
  };
  SimplexSettings settings;
  settings.lower = Eigen::Vector2d(-3, -3);
  settings.upper = Eigen::Vector2d(3, 3);
  settings.step = 0.5;
  settings.max_evaluations = 400;
  settings.x_tolerance = 1e-6;
  const Minimum end = minimise(f, Eigen::Vector2d(-1.2, 1), settings, [] { return false; });
  EXPECT_NEAR(end.x[0], 1, 1e-4);
  EXPECT_NEAR(end.x[1], 1, 1e-4);
  EXPECT_EQ(evaluations, 329) << "as ever";
  SimplexSettings narrow;
  narrow.lower = Eigen::VectorXd::Constant(1, 0.0);
  narrow.upper = Eigen::VectorXd::Constant(1, 2.0);
  const auto falling = [](const Eigen::VectorXd& x) {
    EXPECT_GE(x[0], 0);
    EXPECT_LE(x[0], 2);
    return -x[0];
  };
  EXPECT_NEAR(minimise(falling, Eigen::VectorXd::Constant(1, 0.5), narrow, [] { return false; }).x[0], 2, 1e-6);
}

/// Minimises a function of one or two variables from `start`; counts the evaluations.
struct Bfgs {
  SmoothFunction f;
  Eigen::VectorXd start;
  Eigen::MatrixXd inverse_hessian;
  int most = 100, evaluations = 0;

  Minimum operator()() {
    evaluations = 0;
    const auto counted = [&](const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
      ++evaluations;
      return f(x, gradient);
    };
    return minimise_smooth(counted, start, most, inverse_hessian, [] { return false; });
  }
};

double bowl(const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
  gradient = Eigen::Vector2d(x[0], 10 * x[1]);
  return (x[0] * x[0] + 10 * x[1] * x[1]) / 2;
}

double with_edge(const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
  gradient = Eigen::VectorXd::Constant(1, 5 - 1 / x[0]);
  return x[0] > 0 ? 5 * x[0] - std::log(x[0]) : std::numeric_limits<double>::infinity();
}

TEST(MinimiseSmooth, AKnownHessianLeadsToTheMinimumInStepsOfAtMostOne) {
  const Eigen::MatrixXd inverse = Eigen::Vector2d(1, 0.1).asDiagonal();
  Bfgs search{bowl, Eigen::Vector2d(0.5, -0.5), inverse};
  EXPECT_LT(search().x.norm(), 1e-12);
  EXPECT_EQ(search.evaluations, 2);
  search.start = Eigen::Vector2d(3, -1);
  EXPECT_LT(search().x.norm(), 1e-12);
  EXPECT_EQ(search.evaluations, 4) << "2, 1, 0";
  search.most = 2;
  EXPECT_NEAR(search().x[0], 2, 1e-12);
  EXPECT_EQ(search.evaluations, 2);
}

TEST(MinimiseSmooth, AWrongHessianIsReplaced) {
  for (const double scale : {0.0, -1.0, 100.0}) {
    Bfgs search{bowl, Eigen::Vector2d(3, -2), scale * Eigen::MatrixXd::Identity(2, 2)};
    const Minimum end = search();
    EXPECT_LT(end.x.norm(), 0.01) << scale;
    EXPECT_LT(search.evaluations, 20) << scale;
  }
  Bfgs search{bowl, Eigen::Vector2d(0.5, 0), 2 * Eigen::MatrixXd::Identity(2, 2)};
  EXPECT_LT(search().x.norm(), 1e-12) << "not the mirror point, which is as high as the start";
}

TEST(MinimiseSmooth, FindsTheHessianAndStepsBackFromWhereTheFunctionIsNotFinite) {
  Bfgs search{bowl, Eigen::Vector2d(3, -2), {}};
  const Minimum end = search();
  EXPECT_LT(end.x.norm(), 0.01);
  EXPECT_NEAR(end.inverse_hessian(0, 0), 1, 0.1);
  EXPECT_NEAR(end.inverse_hessian(1, 1), 0.1, 0.01);
  EXPECT_EQ(search.evaluations, 9) << "as ever";
  Bfgs edge{with_edge, Eigen::VectorXd::Ones(1), {}};
  EXPECT_NEAR(edge().x[0], 0.2, 0.002);
  EXPECT_EQ(edge.evaluations, 14) << "as ever";
  edge.start[0] = -1;
  EXPECT_EQ(edge().x[0], -1) << "a start that is not finite is the end";
  EXPECT_EQ(edge.evaluations, 1);
}

// The cost of the reference's long search on its own folds (tune_reference.json). The motorcycle has few samples and
// many minima, of which the grid search must find the right one.
class TuningGolden : public testing::TestWithParam<std::tuple<const char*, WeightKind, double>> {};
INSTANTIATE_TEST_SUITE_P(Shared, TuningGolden,
                         testing::Values(std::tuple{"gyro924", WeightKind::kMyriad, 1.00005},
                                         std::tuple{"mcycle133", WeightKind::kHampel, 1.0002}));

TEST_P(TuningGolden, RobustTenFoldEndsWhereTheReferenceEnds) {
  const auto& [name, kind, factor] = GetParam();
  PRISM_NEEDS(test::golden_dir(name));
  const test::Golden g(name, "A");
  const auto reference = nlohmann::json::parse(test::read_file(test::golden_dir(name) / "tune_reference.json"));
  ReweightSettings settings;
  settings.weight.kind = kind;
  const auto found = tune({g.x, g.y, g.scale, Tuning::kGiven, g.folds, settings}, {});
  ASSERT_TRUE(found) << found.error().text();
  EXPECT_LT(found->best.cost, reference[weight_name(kind)]["cost"].get<double>() * factor);
  // The low-rank cost equals that of 30 complete re-weightings in every fold.
  settings.weight.parameter = found->best.parameter;
  settings.limit = kRobustSolves;
  settings.tolerance = 0;
  const auto exact = cross_validate_robust(compensation::kernel_matrix(g.x, found->best.sigma2), g.y, found->best.c,
                                           settings, g.folds, g.scale);
  ASSERT_TRUE(exact);
  if (kind == WeightKind::kMyriad) {
    EXPECT_LT(test::relative(found->best.cost, exact->mae), 1e-5);
  }
}

class TuningOnWaves : public testing::Test {
 protected:
  TuningOnWaves() : x_(1, 120), y_(120) {
    for (Eigen::Index i = 0; i < 120; ++i) {
      x_(0, i) = (static_cast<double>(i) - 60) / 35;
      y_[i] = std::sin(3 * x_(0, i)) + 0.1 * std::sin(997.0 * static_cast<double>(i));
    }
  }
  TuningCost cost(Tuning kind) { return {x_, y_, 1, kind, shuffled_folds(120, 10, 3), {}}; }
  Eigen::MatrixXd x_;
  Eigen::VectorXd y_;
};

TEST_F(TuningOnWaves, TheNumberOfThreadsChangesNothing) {
  for (const Tuning kind : {Tuning::kShuffled, Tuning::kLoo, Tuning::kReml}) {
    TuningSettings one, four;
    one.threads = 1;
    four.threads = 4;
    const TuningCost objective = cost(kind);
    const auto a = tune(objective, one), b = tune(objective, four);
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->best.c, b->best.c);
    EXPECT_EQ(a->best.sigma2, b->best.sigma2);
    EXPECT_EQ(a->best.cost, b->best.cost);
    EXPECT_EQ(a->evaluations, b->evaluations);
  }
}

TEST_F(TuningOnWaves, PlainCostsEqualThoseOfTheFullMatrix) {
  const TuningPoint point{40, 0.3, 1, 0};
  const Eigen::MatrixXd kernel = compensation::kernel_matrix(x_, point.sigma2);
  EXPECT_NEAR(cost(Tuning::kShuffled).at(point, Effort::kFinal),
              cross_validate(kernel, y_, point.c, shuffled_folds(120, 10, 3), 1)->mae, 1e-7);
  EXPECT_NEAR(cost(Tuning::kLoo).at(point, Effort::kFinal), cross_validate(kernel, y_, point.c, {}, 1)->mae, 1e-7);
  const auto factor = LssvmFactor::make(kernel, Eigen::VectorXd::Constant(120, 1 / point.c), y_);
  EXPECT_NEAR(cost(Tuning::kReml).at(point, Effort::kFinal), -factor->restricted_log_likelihood() / 120, 1e-6);
}

TEST_F(TuningOnWaves, ARowOfTheGridHasTheCostsOfItsPoints) {
  ReweightSettings robust;
  robust.weight.kind = WeightKind::kHuber;
  for (const Tuning kind : {Tuning::kShuffled, Tuning::kLoo, Tuning::kReml}) {
    const TuningCost objective{x_, y_, 1, kind, shuffled_folds(120, 10, 3), robust};
    std::vector<TuningPoint> row;
    for (const double c : {0.1, 30.0, 1e4, 3e6}) row.push_back({c, 0.02, 1.345, 0});
    objective.set_frozen(row);
    for (const TuningPoint& point : row) EXPECT_EQ(point.cost, objective.at(point, Effort::kFrozen)) << point.c;
  }
}

// On a simulated cycle, leave-one-out with myriad's weights ended at delta 0.12 with a narrow kernel: only a third of
// the samples, which agreed with each other, had a weight. On the repeat run the model was worse than none (-277 %).
TEST(Tuning, LeaveOneOutDoesNotChooseAMinorityOfTheSamples) {
  constexpr Eigen::Index kCount = 260;
  Eigen::MatrixXd x(2, kCount);
  Eigen::VectorXd y(kCount);
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (Eigen::Index i = 0; i < kCount; ++i) {
    x.col(i) << normal(random), normal(random);
    y[i] = 0.7 * x(0, i) + 0.7 * normal(random) + (i % 20 == 0 ? 4 : 0);
  }
  ReweightSettings settings;
  settings.weight.kind = WeightKind::kMyriad;
  const auto found = tune({x, y, 1, Tuning::kLoo, {}, settings}, {});
  ASSERT_TRUE(found) << found.error().text();
  EXPECT_EQ(found->best.parameter, 1.5);
  EXPECT_NE(found->warnings.at(0).find("leave-one-out cannot tune the weight's parameter: 1.5 is used"),
            std::string::npos);
}

TEST_F(TuningOnWaves, AStopFlagReturnsTheBestSoFar) {
  std::atomic<bool> stop{false};
  TuningSettings settings;
  settings.progress = [&](int done, int, const TuningPoint&) { stop = stop || done >= 30; };
  settings.stop = &stop;
  const auto found = tune(cost(Tuning::kShuffled), settings);
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->stopped);
  EXPECT_LT(found->evaluations, 40);
  EXPECT_TRUE(std::isfinite(found->best.cost));
}

TEST_F(TuningOnWaves, WarnsOfAnOptimumAtTheEdge) {
  y_ = Eigen::VectorXd::LinSpaced(120, -1, 1).array().square();
  const auto found = tune(cost(Tuning::kShuffled), {});
  ASSERT_TRUE(found);
  ASSERT_FALSE(found->warnings.empty());
  EXPECT_NE(found->warnings[0].find("edge of the search"), std::string::npos) << found->warnings[0];
}

TEST(Folds, ShuffledOnesAreAPermutationOfLsSvmlabsCut) {
  const Folds folds = shuffled_folds(103, 10, 7);
  const auto members = fold_members(folds);
  ASSERT_EQ(members.size(), 10u);
  for (std::size_t i = 0; i < 10; ++i) EXPECT_EQ(members[i].size(), i < 9 ? 10u : 13u);
  EXPECT_EQ(folds, shuffled_folds(103, 10, 7));
  EXPECT_NE(folds, shuffled_folds(103, 10, 8));
}

TEST(Folds, BlocksAreContiguousWithinOneRunAndEveryRunHasOne) {
  std::vector<int> runs(90, 0);
  runs.resize(120, 1);
  const Folds folds = blocked_folds(runs, 8);
  EXPECT_TRUE(std::is_sorted(folds.begin(), folds.end()));
  EXPECT_NE(folds[89], folds[90]);
  EXPECT_EQ(fold_count(folds), 8);
  EXPECT_EQ(folds[89], 5);  // three quarters of the samples take three quarters of the folds
  std::vector<int> brief(10, 0);
  brief.push_back(1);
  EXPECT_NE(blocked_folds(brief, 3)[9], blocked_folds(brief, 3)[10]);
  EXPECT_EQ(blocked_folds({0, 0, 2, 2}, 2), (Folds{0, 0, 1, 1}));
  // As held_out_folds() of recordings that are thinned, if one of them is short: a number without samples.
  const Eigen::VectorXd found = held_out({0, 0, 2}, [](const Rows& rest, const Rows& members) {
    return Eigen::VectorXd::Constant(std::ssize(members), static_cast<double>(rest.size())).eval();
  });
  EXPECT_EQ(found, Eigen::Vector3d(1, 1, 2));
  // Three recordings are held out one by one.
  std::fill(runs.begin() + 70, runs.end(), 1);
  EXPECT_EQ(fold_count(held_out_folds(runs)), 10);
  std::fill(runs.begin() + 100, runs.end(), 2);
  EXPECT_EQ(held_out_folds(runs), runs);
}

TEST(Folds, ColumnsOfAnyIntegersBecomeFoldsFromZero) {
  EXPECT_EQ(folds_from({7, -1, 7, 3}).value(), (Folds{2, 0, 2, 1}));
  EXPECT_FALSE(folds_from({1, 1, 1}));
  EXPECT_FALSE(folds_from({1, 1.5}));
}

}  // namespace
}  // namespace prism::training
