// SPDX-License-Identifier: MIT
// Gross outliers: found exactly, whatever their size, and without effect on a robust training.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "compensation/extrapolation.hpp"
#include "compensation/training/robust.hpp"
#include "compensation/training/trainer.hpp"

namespace prism::training {
namespace {

constexpr double kSigma = 0.001;

TrainingData clean(Eigen::Index n) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  TrainingData data;
  data.names = {"T", "U"};
  data.inputs.resize(2, n);
  data.target.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double at = static_cast<double>(i) / static_cast<double>(n), t = 60 * std::sin(12 * at),
                 u = 5.5 + 0.1 * std::cos(31 * at);
    data.inputs.col(i) << t, u;
    data.target[i] = 0.3 + 0.02 * std::tanh(t / 20) + 0.05 * (u - 5.5) + kSigma * normal(random);
  }
  return data;
}

struct Contamination {
  const char* name;
  Eigen::Index burst;
  double noises;
  bool one_side;
};
constexpr Contamination kContaminations[] = {{"isolated, one side", 1, 1e3, true},
                                             {"bursts, one side", 8, 1e3, true},
                                             {"bursts, both sides", 8, 1e5, false},
                                             {"huge bursts", 8, 1e9, true}};

// At most 10 % of the rows; returns them.
std::set<Eigen::Index> contaminate(TrainingData& data, const Contamination& c) {
  std::mt19937_64 random(8);
  std::set<Eigen::Index> rows;
  const Eigen::Index n = data.target.size();
  while (static_cast<Eigen::Index>(rows.size()) + c.burst <= n / 10) {
    const Eigen::Index first = static_cast<Eigen::Index>(random() % static_cast<std::uint64_t>(n - c.burst));
    for (Eigen::Index i = first; i < first + c.burst; ++i) rows.insert(i);
  }
  for (const Eigen::Index i : rows)
    data.target[i] += (c.one_side || random() % 2 ? 1 : -1) * c.noises * kSigma * (1 + static_cast<double>(i % 5));
  return rows;
}

std::vector<Eigen::Index> found_in(const TrainingData& data) {
  return gross_outliers(data.inputs, data.target, std::vector<int>(static_cast<std::size_t>(data.target.size()), 0));
}

TEST(GrossOutliers, AreFoundExactly) {
  for (const Contamination& c : kContaminations) {
    for (const Eigen::Index n : {200, 900}) {
      TrainingData data = clean(n);
      const auto rows = contaminate(data, c);
      EXPECT_EQ(found_in(data), std::vector(rows.begin(), rows.end())) << c.name << " " << n;
    }
  }
}

TEST(GrossOutliers, SpareCleanRecordsAndModerateOutliers) {
  TrainingData data = clean(400);
  EXPECT_TRUE(found_in(data).empty());
  data.target[50] += 20 * kSigma;  // left to the robust weights
  EXPECT_TRUE(found_in(data).empty());
  EXPECT_TRUE(found_in(clean(12)).empty());
}

TEST(GrossOutliers, AreNamedAsRanges) {
  EXPECT_EQ(rows_text({2}), "3");
  EXPECT_EQ(rows_text({2, 7, 8, 9}), "3, 8 to 10");
  EXPECT_EQ(rows_text({0, 2, 4, 6, 8, 10, 12, 14}), "1, 3, 5, 7, 9, 11 and 2 others");
}

// Over the rows of the record, with the default policy.
double worst_difference(const compensation::Model& a, const compensation::Model& b) {
  const TrainingData data = clean(200);
  double worst = 0;
  for (Eigen::Index i = 0; i < data.target.size(); ++i) {
    const std::vector<double> x{data.inputs(0, i), data.inputs(1, i)};
    const auto served = [&](const compensation::Model& m) {
      return compensation::predict_within(m, x, compensation::Extrapolation::kPreset).bias_deg_per_h;
    };
    worst = std::max(worst, std::abs(served(a) - served(b)));
  }
  return worst;
}

struct Way {
  const char* method;
  Tuning tuning;
  double limit = 3;  ///< largest change, in standard deviations of the noise
};

class Breakdown : public testing::TestWithParam<Way> {};

TEST_P(Breakdown, MovesPredictionsByLittle) {
  TrainingSettings settings;
  settings.method = find_method(GetParam().method);
  settings.tuning = GetParam().tuning;
  settings.folds = 3;
  const auto good = train(clean(200), {}, settings);
  ASSERT_TRUE(good) << good.error().text();
  for (const Contamination& c : {kContaminations[0], kContaminations[3]}) {  // the others lose the same rows
    TrainingData data = clean(200);
    const auto rows = contaminate(data, c);
    const auto trained = train(data, {}, settings);
    ASSERT_TRUE(trained) << trained.error().text();
    EXPECT_LT(worst_difference(*trained->model, *good->model), GetParam().limit * kSigma) << c.name;
    EXPECT_EQ(trained->samples.weight[*rows.begin()], 0) << c.name;
    EXPECT_EQ(trained->samples.fitted.size(), 200);
    ASSERT_FALSE(trained->notes.empty());
    EXPECT_NE(trained->notes.back().find(" of 200 rows are far from all others and were left out: rows "),
              std::string::npos);
  }
}

INSTANTIATE_TEST_SUITE_P(Ways, Breakdown,
                         testing::Values(Way{"composite", Tuning::kBlocked}, Way{"ir-lssvm", Tuning::kBlocked},
                                         Way{"ir-lssvm", Tuning::kShuffled}, Way{"ir-lssvm", Tuning::kLoo},
                                         Way{"ir-lssvm", Tuning::kReml}));

// On gyros with drift either division chose kernels that moved predictions by four standard deviations of the noise.
TEST(GrossOutliers, AreLeftOutOfBothDivisionsIntoFolds) {
  TrainingSettings settings;
  settings.method = find_method("ir-lssvm");
  settings.folds = 3;
  TrainingData data = clean(240);  // above 200 rows the search is short
  const auto rows = contaminate(data, kContaminations[1]);
  const std::vector<Eigen::Index> rest = others({rows.begin(), rows.end()}, 240);
  const TrainingData part{data.names, data.inputs(Eigen::all, rest), data.target(rest), {}, {}};
  double share = 0;  // of the tuning that is done; one progress for both divisions
  const auto grows = [&share](int done, int expected, const TuningPoint&) {
    EXPECT_GE(done, share * expected);
    share = static_cast<double>(done) / expected;
  };
  TrainingSettings watched = settings;
  watched.progress = grows;
  const auto trained = train(data, {}, watched), first = train(part, {}, settings);
  EXPECT_GT(share, 0.5);
  settings.tuning = Tuning::kGiven;
  settings.given_folds = taken(blocked_folds(runs_of(data), 3), rest);
  const auto second = train(part, {}, settings);
  ASSERT_TRUE(trained && first && second);
  EXPECT_NE(first->sigma2, second->sigma2);
  EXPECT_NEAR(trained->sigma2, std::sqrt(first->sigma2 * second->sigma2), 1e-9 * trained->sigma2);
  EXPECT_NEAR(trained->c, std::sqrt(first->c * second->c), 1e-9 * trained->c);
  EXPECT_EQ(trained->tuning->best.c, trained->c);
  EXPECT_GT(trained->tuning->evaluations, first->tuning->evaluations);
}

TEST(Trainer, RefusesRecordsWithNothingToLearnInOneLine) {
  TrainingSettings settings;
  TrainingData still = clean(100);
  still.target.setConstant(0.25);
  for (const char* method : {"composite", "stepwise", "ir-lssvm", "svr"}) {
    settings.method = find_method(method);
    settings.terms = second_order_terms(2);
    EXPECT_EQ(train(still, {}, settings).error().text(),
              "training data: the target is 0.25 in all 100 rows, expected one that changes")
        << method;
  }
  settings.method = find_method("composite");
  EXPECT_EQ(train(clean(9), {}, settings).error().text(), "training data: found 9 rows, expected at least 10");
  TrainingData twice = clean(100);
  for (Eigen::Index i = 0; i < 50; ++i) {
    twice.inputs.col(50 + i) = twice.inputs.col(i);
    twice.target[50 + i] = twice.target[i];
  }
  EXPECT_EQ(train(twice, {}, settings).error().text(),
            "training data: 50 of 100 rows repeat an earlier row, expected different rows");
  TrainingData torn = clean(100);
  for (Eigen::Index i = 0; i < 30; ++i) torn.target[3 * i] += 1e6;
  EXPECT_EQ(train(torn, {}, settings).error().text().substr(0, 96),
            "training data: found 30 of 100 rows far from all others, expected at most a quarter: rows 1, 4, ");
}

}  // namespace
}  // namespace prism::training
