// SPDX-License-Identifier: MIT
// From samples to a model: every method finds a simulated truth, with a valid standard deviation and despite outliers.
#include "compensation/training/trainer.hpp"

#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>
#include <set>

#include "compensation/composite_model.hpp"
#include "compensation/training/held_out.hpp"
#include "compensation/training/robust.hpp"
#include "tests/support/trained.hpp"

namespace prism::training {
namespace {

using test::served;
using test::settings_of;
using test::trained;
using test::training_error;

double truth(double t, double u) { return 0.3 + 0.02 * std::sin(t / 20) + 0.05 * (u - 5.5); }

// A drift in engineering units with noise of 0.01 · 0.02 deg/h and 3 % outliers.
TrainingData drift(Eigen::Index n, bool outliers = true) {
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal;
  return test::record({"T", "U"}, n, [&](double i, double* x) {
    x[0] = 60 * std::sin(i * 0.05), x[1] = 5.5 + 0.1 * std::cos(i * 0.031);
    return truth(x[0], x[1]) + 0.0002 * normal(random) + (outliers && std::fmod(i, 33) == 7 ? 0.2 : 0);
  });
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
  const auto plain = trained(drift(400), settings_of("lssvm", 300, 0.5));
  const auto robust = trained(drift(400), settings_of("ir-lssvm", 300, 0.5));
  EXPECT_LT(worst_error(*robust.model), 0.2 * worst_error(*plain.model));
  EXPECT_LT(worst_error(*robust.model), 0.001);
  EXPECT_EQ(robust.model->info().kind, "ir_lssvm");
  EXPECT_LT(robust.samples.weight[7], 0.05);
}

TEST(Trainer, TheStatedDeviationCoversTheError) {
  TrainingSettings settings = settings_of("ir-lssvm");
  settings.reweight.weight.kind = WeightKind::kHuber;
  settings.tuning = Tuning::kShuffled;
  const auto model = trained(drift(300), settings).model;
  int covered = 0, all = 0;
  for (double t = -50; t <= 50; t += 5) {
    for (double u = 5.42; u < 5.59; u += 0.04, ++all) {
      const compensation::Prediction p = model->predict(std::vector{t, u});
      EXPECT_GT(p.sd_deg_per_h, 0);
      covered += std::fabs(p.bias_deg_per_h - truth(t, u)) < 2 * p.sd_deg_per_h;
    }
  }
  EXPECT_GT(covered, 0.85 * all);
}

TEST(Trainer, TheGuardDetectsGapsInTheData) {
  const TrainingData data = drift(400, false);
  const auto model = trained(data, settings_of("lssvm", 300, 0.05)).model;
  int flagged = 0;
  for (Eigen::Index i = 0; i < 400; ++i)
    flagged += model->predict(std::vector{data.inputs(0, i), data.inputs(1, i)}).extrapolating;
  EXPECT_LT(flagged, 12);
  EXPECT_TRUE(model->predict(std::vector{200.0, 5.5}).extrapolating);  // outside the box
  EXPECT_TRUE(model->predict(std::vector{0.0, 5.9}).extrapolating);
}

TEST(Trainer, LongRecordsBecomeSparseModelsWithEqualPredictions) {
  const auto sparse = trained(drift(6000), settings_of("ir-lssvm", 1000, 0.5));
  EXPECT_EQ(sparse.model->info().kind, "sparse_lssvm");
  EXPECT_LT(sparse.centres, 400);
  EXPECT_LT(worst_error(*sparse.model), 0.0005);
  const compensation::Prediction near = sparse.model->predict(std::vector{0.0, 5.5}),
                                 far = sparse.model->predict(std::vector{0.0, 7.5});
  EXPECT_GT(near.sd_deg_per_h, 0);
  EXPECT_GT(far.sd_deg_per_h, 1.5 * near.sd_deg_per_h);
  EXPECT_TRUE(far.extrapolating);
  test::read_back(*sparse.model, {{0, 5.5}});
}

TEST(Trainer, SupportVectorRegressionFindsTheDrift) {
  TrainingSettings settings = settings_of("svr", 30, 0.5);
  settings.epsilon = 0.05;
  const auto found = trained(drift(300, false), settings);
  EXPECT_LT(worst_error(*found.model), 0.003);
  EXPECT_LT(found.centres, 300);
  EXPECT_GT(found.model->predict(std::vector{0.0, 5.5}).sd_deg_per_h, 0);
}

TEST(Trainer, StepwiseFindsTheSimulatedTerms) {
  const TrainingData data = test::record({"T", "U"}, 300, [](double i, double* x) {
    x[0] = 60 * std::sin(i * 0.05), x[1] = 5.5 + 0.1 * std::cos(i * 0.031);
    return 0.1 + 0.002 * x[0] - 1e-5 * x[0] * x[0] + 1e-4 * std::sin(777.0 * i);
  });
  TrainingSettings settings = settings_of("stepwise");
  settings.terms = second_order_terms(2);
  const auto found = trained(data, settings);
  std::vector<std::string> names;
  for (const int term : found.polynomial->terms)
    names.push_back(term_name(settings.terms[static_cast<std::size_t>(term)], data.names));
  EXPECT_EQ(std::vector(names.begin(), names.begin() + 2), (std::vector<std::string>{"T", "T^2"}));
  EXPECT_NEAR(found.model->predict(std::vector{40.0, 5.5}).bias_deg_per_h, 0.1 + 0.08 - 0.016, 1e-4);
}

TEST(ResourcePlan, RejectsTooLargeTrainingsBeforeTheyStart) {
  const auto fits = plan_resources(100000, 3, settings_of("ir-lssvm"));
  ASSERT_TRUE(fits);
  EXPECT_TRUE(fits->sparse);
  EXPECT_LT(fits->bytes, 1e9);
  const auto huge = plan_resources(10'000'000, 3, settings_of("ir-lssvm"));
  ASSERT_FALSE(huge);
  EXPECT_NE(huge.error().text().find("use fewer samples"), std::string::npos);
  EXPECT_FALSE(plan_resources(100000, 3, settings_of("svr")));
}

// By hand: bytes and seconds of the formulas in trainer.cpp, at 4e9 operations a second.
TEST(ResourcePlan, IsThatOfTheFormulas) {
  struct Case {
    const char* method;
    Eigen::Index samples;
    double limit, megabytes, seconds;
    Eigen::Index centres;  // 0: one per sample
  };
  for (const Case& c : {Case{"ls", 1000, 1e9, 0.16, 0, 0},
                        {"stepwise", 1000, 1e9, 0.16, 0, 0},
                        {"lssvm", 1000, 1e9, 40, 1.0 / 6, 0},
                        {"ir-lssvm", 1000, 1e9, 40, 2.5, 0},
                        {"ir-lssvm", 4000, 1e9, 640, 160, 0},
                        {"lssvm", 5000, 600e6, 600, 125.0 / 6, 0},
                        {"lssvm", 5001, 1e9, 5001 * 8 * 616e-6 + 17.28, 11.2522500, 600},
                        {"ir-lssvm", 100'000, 1e9, 510.08, 225, 600},
                        {"ir-lssvm", 100'000, 100e6, 79.530672, 4.305625, 83},
                        {"ir-lssvm", 100'000, 67.1e6, 52.92, 1.5625, 50},
                        {"svr", 1000, 1e9, 204, 0.1, 0},
                        {"composite", 1000, 1e9, 40, 16.25, 0},
                        {"composite", 3000, 1e9, 360, 15 + 33.75, 0},
                        {"composite", 3001, 1e9, 3001 * 8 * 416e-6 + 7.68, 3001 * 160e3 * 25 / 4e9, 400}}) {
    TrainingSettings settings = settings_of(c.method);
    settings.terms = cubic_terms();
    settings.memory_limit_bytes = c.limit;
    const auto plan = plan_resources(c.samples, 3, settings);
    ASSERT_TRUE(plan) << plan.error().text();
    SCOPED_TRACE(c.method + std::to_string(c.samples));
    EXPECT_NEAR(plan->bytes / 1e6, c.megabytes, 1e-9 * c.megabytes);
    EXPECT_NEAR(plan->seconds, c.seconds, 1e-9 * c.seconds);
    EXPECT_EQ(plan->max_rank, c.centres);
    EXPECT_EQ(plan->sparse, c.centres > 0);
  }
  TrainingSettings once = settings_of("ir-lssvm");
  once.reweight.limit = 1;
  EXPECT_EQ(plan_resources(1000, 3, once)->text(), "one centre per sample, about 40 MB and 0.2 s");
  EXPECT_NEAR(plan_resources(1000, 3, once)->seconds, 0.25, 1e-12);
  EXPECT_EQ(plan_resources(100'000, 3, once)->text(), "sparse model of at most 600 centres, about 511 MB and 225.0 s");
  once.memory_limit_bytes = 66.9e6;
  EXPECT_EQ(plan_resources(100'000, 3, once).error().text(),
            "memory: 100000 samples leave memory for 49 centres within 67 MB, expected at least 50: use fewer samples");
  once.memory_limit_bytes = 599e6;
  EXPECT_EQ(plan_resources(5000, 3, once).error().text(),
            "memory: 5000 samples need about 600 MB, expected at most 599 MB");
}

TEST(Normalisation, IsThatOfItsMethodAndTheWayBack) {
  TrainingData data = test::record({"two", "few", "many"}, 10, [](double i, double* x) {
    x[0] = i < 3 ? 4 : 10, x[1] = std::fmod(i, 3), x[2] = i * i;
    return i < 5 ? 1 : 3;
  });
  const auto constants = [&](NormalisationMethod scaling) { return normalise(data, scaling).value().constants; };
  const compensation::Normalisation own = constants(NormalisationMethod::kAuto),
                                    z = constants(NormalisationMethod::kZscore),
                                    none = constants(NormalisationMethod::kNone);
  EXPECT_EQ(own.input_shift, Eigen::Vector3d(7, 0, 28.5));
  EXPECT_EQ(own.input_scale.head(2), Eigen::Vector2d(3, 1)) << "fewer than the root of 10 values are unchanged";
  EXPECT_DOUBLE_EQ(own.input_scale[2], std::sqrt((15333 - 10 * 28.5 * 28.5) / 9));
  EXPECT_EQ(own.target_shift, 2);
  EXPECT_EQ(own.target_scale, 1);
  EXPECT_DOUBLE_EQ(z.input_shift[0], 8.2);
  EXPECT_DOUBLE_EQ(z.input_scale[0], std::sqrt((3 * 4.2 * 4.2 + 7 * 1.8 * 1.8) / 9));
  EXPECT_DOUBLE_EQ(z.input_scale[1], std::sqrt((4 * 0.81 + 3 * 0.01 + 3 * 1.21) / 9));
  EXPECT_EQ(z.target_scale, 1) << "divisor N";
  EXPECT_EQ(none.input_shift, Eigen::Vector3d::Zero());
  EXPECT_EQ(none.input_scale, Eigen::Vector3d::Ones());
  data.inputs.conservativeResize(3, 9);
  data.target.conservativeResize(9);
  EXPECT_EQ(constants(NormalisationMethod::kAuto).input_shift[1], 1) << "3 values are the root of 9";
  data.target.setConstant(0.1);
  EXPECT_EQ(constants(NormalisationMethod::kZscore).target_scale, 1);
  data.inputs.row(1).setConstant(0.1);
  EXPECT_EQ(normalise(data, NormalisationMethod::kZscore).error().text(),
            "few: the input is constant, expected one that changes");
  data.inputs(0, 0) = std::nan("");
  EXPECT_FALSE(normalise(data, NormalisationMethod::kNone));
  data.inputs.conservativeResize(3, 1);
  EXPECT_EQ(normalise(data, NormalisationMethod::kNone).error().text(),
            "training data: found fewer than two rows, expected at least 2");
}

TEST(Trainer, FoldsAreTwoToOnePerSampleWhereTheyAreUsed) {
  const TrainingData data = drift(10, false);
  const auto error = [&](const char* method, Tuning tuning, int folds, std::optional<double> given = {}) {
    TrainingSettings settings = settings_of(method, given, given);
    settings.tuning = tuning;
    settings.folds = folds;
    return training_error(data, settings);
  };
  const std::string needs = "folds: found 1, expected 2 to the number of samples, 10";
  for (const char* method : {"composite", "ir-lssvm", "svr"}) {
    for (const Tuning tuning : {Tuning::kBlocked, Tuning::kShuffled})
      EXPECT_EQ(error(method, tuning, 1), needs) << method;
  }
  EXPECT_EQ(error("svr", Tuning::kBlocked, 11), "folds: found 11, expected 2 to the number of samples, 10");
  EXPECT_EQ(error("svr", Tuning::kBlocked, 10), "");
  EXPECT_EQ(error("svr", Tuning::kShuffled, 2), "");
  EXPECT_EQ(error("lssvm", Tuning::kBlocked, 1, 3), "") << "c and sigma2 are given";
  for (const Tuning tuning : {Tuning::kLoo, Tuning::kReml})
    EXPECT_EQ(error("svr", tuning, 1),
              "tuning: found leave-one-out or reml for svr, expected folds: blocked or shuffled");
}

TEST(Trainer, ASparseModelSaysThatItsCentresAreTooFew) {
  const TrainingData data = drift(200, false);
  const TrainingSettings settings = settings_of("lssvm", 300, 0.5);
  const auto notes = [&](Eigen::Index centres) {
    compensation::ModelInfo info;
    info.inputs = data.names;
    const auto made = train_kernel({data, info, settings, {0, 0, true, centres}, runs_of(data)});
    EXPECT_EQ(made->model->info().kind, "sparse_lssvm");
    return fmt::format("{}", fmt::join(made->notes, "; "));
  };
  EXPECT_EQ(notes(5), "5 centres do not represent 0.68 of the kernel: use a wider kernel or more memory");
  EXPECT_EQ(notes(150), "");
}

TEST(Trainer, AnErrorOfTheSearchForACompositeKernelIsReported) {
  TrainingData data = drift(40, false);
  data.inputs *= 1e160;  // the quadratic kernel overflows
  TrainingSettings settings = settings_of("composite");
  settings.scaling = NormalisationMethod::kNone;
  EXPECT_EQ(training_error(data, settings), "composite kernel: the search found no finite likelihood");
}

TEST(Methods, AreFoundAndListedByWhatTheyUse) {
  for (const Method& method : methods()) EXPECT_EQ(find_method(method.name), &method);
  EXPECT_EQ(find_method("unknown"), nullptr);
  EXPECT_EQ(method_names(kTuning, " and "), "lssvm, ir-lssvm and svr");
  EXPECT_EQ(method_names(kSiblings, " or "), "composite");
}

constexpr double kSigma = 0.001;

TrainingData clean(Eigen::Index n) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  return test::record({"T", "U"}, n, [&](double i, double* x) {
    const double at = i / static_cast<double>(n);
    x[0] = 60 * std::sin(12 * at), x[1] = 5.5 + 0.1 * std::cos(31 * at);
    return 0.3 + 0.02 * std::tanh(x[0] / 20) + 0.05 * (x[1] - 5.5) + kSigma * normal(random);
  });
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

std::vector<Eigen::Index> outliers_in(const TrainingData& data) {
  return gross_outliers(data.inputs, data.target, std::vector<int>(static_cast<std::size_t>(data.target.size()), 0));
}

TEST(GrossOutliers, AreFoundExactlyAndNamedAsRanges) {
  for (const Contamination& c : kContaminations) {
    for (const Eigen::Index n : {200, 900}) {
      TrainingData data = clean(n);
      const auto rows = contaminate(data, c);
      EXPECT_EQ(outliers_in(data), std::vector(rows.begin(), rows.end())) << c.name << " " << n;
    }
  }
  TrainingData data = clean(400);
  EXPECT_TRUE(outliers_in(data).empty());
  data.target[50] += 20 * kSigma;  // left to the robust weights
  EXPECT_TRUE(outliers_in(data).empty());
  EXPECT_TRUE(outliers_in(clean(12)).empty());
  EXPECT_EQ(rows_text({2}), "3");
  EXPECT_EQ(rows_text({2, 7, 8, 9}), "3, 8 to 10");
  EXPECT_EQ(rows_text({0, 2, 4, 6, 8, 10, 12, 14}), "1, 3, 5, 7, 9, 11 and 2 others");
}

TEST(RobustScale, IsThatOfHazensQuartilesOrOfWhatIsNotZero) {
  const auto iqr = [](std::vector<double> r) {
    const Eigen::VectorXd residuals = Eigen::VectorXd::Map(r.data(), std::ssize(r));
    return robust_scale(residuals, ScaleKind::kIqr) * 2 * 0.6745;
  };
  EXPECT_DOUBLE_EQ(iqr({10, 0, 2, 1}), 6 - 0.5);  // quartiles at 0.5 and 2.5
  EXPECT_DOUBLE_EQ(iqr({4, 1}), 3);               // at 0 and 1
  EXPECT_DOUBLE_EQ(iqr({0, 1, 2, 10, 20}), 12.5 - 0.75);
  EXPECT_EQ(iqr({7}), 0);
  EXPECT_EQ(iqr({0, 0, 0, 0, 0, 0, 0, 0, 0, 8}), 1.2533 * 0.8 * 2 * 0.6745) << "the mean distance";
  const Eigen::Vector4d steps(0, 0, 0, 1);
  EXPECT_EQ(robust_scale(steps, ScaleKind::kMad), robust_scale(steps, ScaleKind::kIqr)) << "its median distance is 0";
}

class Breakdown : public testing::TestWithParam<std::pair<const char*, Tuning>> {};
INSTANTIATE_TEST_SUITE_P(Ways, Breakdown,
                         testing::Values(std::pair{"composite", Tuning::kBlocked},
                                         std::pair{"ir-lssvm", Tuning::kBlocked},
                                         std::pair{"ir-lssvm", Tuning::kShuffled}, std::pair{"ir-lssvm", Tuning::kLoo},
                                         std::pair{"ir-lssvm", Tuning::kReml}));

TEST_P(Breakdown, MovesPredictionsByLittle) {
  TrainingSettings settings = settings_of(GetParam().first);
  settings.tuning = GetParam().second;
  settings.folds = 3;
  const TrainingData rows = clean(200);
  const auto good = trained(rows, settings);
  for (const Contamination& c : {kContaminations[0], kContaminations[3]}) {  // the others lose the same rows
    TrainingData data = rows;
    const auto wrong = contaminate(data, c);
    const auto found = trained(data, settings);
    double worst = 0;
    for (Eigen::Index i = 0; i < 200; ++i) {
      const std::vector x{rows.inputs(0, i), rows.inputs(1, i)};
      worst = std::max(worst, std::abs(served(*found.model, x).bias_deg_per_h - served(*good.model, x).bias_deg_per_h));
    }
    EXPECT_LT(worst, 3 * kSigma) << c.name;
    EXPECT_EQ(found.samples.weight[*wrong.begin()], 0) << c.name;
    EXPECT_EQ(found.samples.fitted.size(), 200);
    ASSERT_FALSE(found.notes.empty());
    EXPECT_NE(found.notes.back().find(" of 200 rows are far from all others and were left out: rows "),
              std::string::npos);
  }
}

// On gyros with drift either division chose kernels that moved predictions by four standard deviations of the noise.
TEST(GrossOutliers, AreLeftOutOfBothDivisionsIntoFolds) {
  TrainingSettings settings = settings_of("ir-lssvm");
  settings.folds = 3;
  TrainingData data = clean(240);  // above 200 rows the search is short
  const auto rows = contaminate(data, kContaminations[1]);
  const std::vector<Eigen::Index> rest = others({rows.begin(), rows.end()}, 240);
  const TrainingData part{data.names, data.inputs(Eigen::all, rest), data.target(rest), {}, {}};
  double share = 0;  // of the tuning that is done; one progress for both divisions
  TrainingSettings watched = settings;
  watched.progress = [&share](int done, int expected, const TuningPoint&) {
    EXPECT_GE(done, share * expected);
    share = static_cast<double>(done) / expected;
  };
  const auto both = trained(data, watched), first = trained(part, settings);
  EXPECT_GT(share, 0.5);
  settings.tuning = Tuning::kGiven;
  settings.given_folds = taken(blocked_folds(runs_of(data), 3), rest);
  const auto second = trained(part, settings);
  EXPECT_NE(first.sigma2, second.sigma2);
  EXPECT_NEAR(both.sigma2, std::sqrt(first.sigma2 * second.sigma2), 1e-9 * both.sigma2);
  EXPECT_NEAR(both.c, std::sqrt(first.c * second.c), 1e-9 * both.c);
  EXPECT_EQ(both.tuning->best.c, both.c);
  EXPECT_GT(both.tuning->evaluations, first.tuning->evaluations);
}

TEST(Trainer, RefusesUnusableRecordsInOneLine) {
  TrainingData still = clean(100);
  still.target.setConstant(0.25);
  for (const char* method : {"composite", "stepwise", "ir-lssvm", "svr"}) {
    TrainingSettings settings = settings_of(method);
    settings.terms = second_order_terms(2);
    EXPECT_EQ(training_error(still, settings),
              "training data: the target is 0.25 in all 100 rows, expected one that changes")
        << method;
  }
  TrainingData cold = clean(100), hole = clean(100), gap = clean(100), twice = clean(100), torn = clean(100);
  cold.inputs.row(0).setConstant(25.1);
  hole.target[3] = std::nan("");
  gap.inputs(0, 3) = std::nan("");
  for (Eigen::Index i = 0; i < 50; ++i)
    twice.inputs.col(50 + i) = twice.inputs.col(i), twice.target[50 + i] = twice.target[i];
  for (Eigen::Index i = 0; i < 30; ++i) torn.target[3 * i] += 1e6;
  EXPECT_EQ(training_error(clean(9), {}), "training data: found 9 rows, expected at least 10");
  EXPECT_EQ(training_error(cold, {}), "T: the input is constant, expected one that changes");
  for (const TrainingData& bad : {hole, gap})
    EXPECT_EQ(training_error(bad, {}), "training data: found a number that is not finite");
  EXPECT_EQ(training_error(twice, {}), "training data: 50 of 100 rows repeat an earlier row, expected different rows");
  EXPECT_EQ(training_error(torn, {}).substr(0, 96),
            "training data: found 30 of 100 rows far from all others, expected at most a quarter: rows 1, 4, ");
  EXPECT_EQ(training_error(drift(100), settings_of("composite", 3)),
            "c and sigma2: found one of them, expected both or none");
}

// Every method predicts its error in a new run: simulated runs with their own drift and white noise.
constexpr double kWhite = 0.006, kWander = 0.005;  // deg/h
constexpr Eigen::Index kRows = 600;

// 0.02 tanh(T / 20) + a random walk with a memory of about 30 rows + noise.
TrainingData run(unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  double walk = kWander * normal(random);
  return test::record({"T"}, kRows, [&](double i, double* t) {
    *t = 60 * std::sin(12.6 * i / kRows);
    walk = 0.97 * walk + kWander * std::sqrt(1 - 0.97 * 0.97) * normal(random);
    return 0.3 + 0.02 * std::tanh(*t / 20) + walk + kWhite * normal(random);
  });
}

TrainingSettings fixed_settings(std::string_view method) {
  TrainingSettings settings = method == "composite" ? settings_of(method) : settings_of(method, 30, 0.5);
  settings.terms = cubic_terms();
  return settings;
}

class SpreadOf : public testing::TestWithParam<const char*> {};

TEST_P(SpreadOf, ANewRunLiesWithinTwoOfTheStatedDeviations) {
  double covered = 0, rows = 0;
  for (const unsigned seed : {1u, 2u, 3u}) {
    const auto model = trained(run(10 * seed), fixed_settings(GetParam())).model;
    const auto& spread = model->info().spread;
    ASSERT_TRUE(spread);
    EXPECT_EQ(spread->blocks, 10);
    EXPECT_GT(spread->samples, kRows / 2);
    EXPECT_NEAR(spread->noise_deg_per_h, kWhite, 0.15 * kWhite);
    const TrainingData next = run(10 * seed + 1);
    for (Eigen::Index i = 0; i < kRows; ++i, ++rows) {
      const auto p = served(*model, {next.inputs(0, i)});
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

TEST(BetweenRunError, IsPartOfTheFileAndOfTheIdAndAShortRecordHasNone) {
  const auto model = trained(run(5), fixed_settings("ls")).model;
  test::read_back(*model, {{1}});
  EXPECT_NE(test::error_after_edit(*model, "\"samples\": "), "");
  TrainingData data = run(7);
  data.inputs = data.inputs.leftCols(30).eval();
  data.target = data.target.head(30).eval();
  const auto brief = trained(data, fixed_settings("ls")).model;
  TrainingData late = run(7);  // without the last block the temperature is constant
  late.inputs.leftCols(kRows - 30).setZero();
  EXPECT_FALSE(trained(late, fixed_settings("ls")).model->info().spread);
  EXPECT_FALSE(brief->info().spread);
  EXPECT_TRUE(std::isnan(brief->predict(std::vector{1.0}).sd_mean_deg_per_h));
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

// A short record with a population prior: gyros of one type, similar in shape, each with a scale.
struct Gyro {
  double level, scale, tilt;

  double bias(double t) const { return level + scale * (0.02 * std::sin(t / 15) + 1e-4 * t) + tilt * t; }
  /// The first rows of a cycle of 400 over ±60 degC.
  TrainingData record(Eigen::Index rows, unsigned seed) const {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    return test::record({"T"}, rows, [&](double i, double* t) {
      *t = -60 * std::cos(6.2832 * i / 400);
      return bias(*t) + 0.003 * normal(random);
    });
  }
};

struct Siblings : testing::Test {
  Siblings() {
    for (const Gyro& gyro : {Gyro{0.3, 1, 2e-5}, Gyro{-0.1, 1.1, 0}, Gyro{0.5, 0.9, -3e-5}, Gyro{0, 1.05, 2e-5}}) {
      const std::size_t number = settings.siblings.size();
      settings.siblings.push_back(
          trained(gyro.record(400, static_cast<unsigned>(number)), {}, std::to_string(number)).model);
    }
  }
  TrainingSettings settings;
  const Gyro own{1.2, 1.2, 1e-5};
};

TEST_F(Siblings, AShortRecordPredictsTheCompleteCycle) {
  // Rms over the cycle, level removed, and the fraction within 2 sd with the level.
  const auto judged = [&](const compensation::Model& model) {
    Eigen::VectorXd error(41);
    double covered = 0;
    for (Eigen::Index i = 0; i < 41; ++i) {
      const double t = -60 + 3 * static_cast<double>(i);
      const auto p = served(model, {t});
      error[i] = own.bias(t) - p.bias_deg_per_h;
      covered += std::fabs(error[i]) < 2 * p.sd_deg_per_h;
    }
    return std::pair(std::sqrt((error.array() - error.mean()).square().mean()), covered / 41);
  };
  const TrainingData data = own.record(80, 77);  // -60 to -19 degC
  const auto together = trained(data, settings);
  const auto [rms, covered] = judged(*together.model);
  EXPECT_LT(rms, 0.003);
  EXPECT_LT(rms, judged(*trained(data, {}).model).first / 3);
  EXPECT_GT(covered, 0.9);
  const auto& prior = static_cast<const compensation::CompositeModel&>(*together.model).parameters().prior;
  ASSERT_TRUE(prior);
  EXPECT_GT(prior->scale, 1.03);  // 1.19, shrunk towards 1 by the prior of the scale
  EXPECT_LT(prior->scale, 1.25);
  EXPECT_GT(*together.from_siblings, 0.8);
  EXPECT_FALSE(together.model->predict(std::vector{40.0}).extrapolating) << "in the range of the prior's models";
  EXPECT_TRUE(together.model->predict(std::vector{90.0}).extrapolating);
  test::read_back(*together.model, {{-70}, {-40}, {30}});
  EXPECT_NE(test::error_after_edit(*together.model, "\"scale\": "), "");
  EXPECT_EQ(test::error_after_edit(*together.model, "\"length_s\": ", "\"prior\"").find("m.json:/prior/models/0"), 0u);
}

TEST_F(Siblings, RejectsUnsuitableModels) {
  TrainingData other = own.record(80, 79);
  other.names = {"U"};
  EXPECT_NE(training_error(other, settings).find("found inputs T, expected U"), std::string::npos);
  TrainingSettings ls = settings;
  ls.method = find_method("ls");
  ls.terms = cubic_terms();
  EXPECT_EQ(training_error(own.record(80, 79), ls), "prior: found method ls, expected composite");
  settings.siblings.resize(1);
  EXPECT_EQ(training_error(own.record(80, 79), settings), "prior: found 1 models, expected at least 2");
}

}  // namespace
}  // namespace prism::training
