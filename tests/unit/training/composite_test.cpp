// SPDX-License-Identifier: MIT
// The composite kernel, compared with the external reference and with finite differences.
#include "compensation/training/composite.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "tests/support/trained.hpp"
#include "tests/unit/training/golden.hpp"

namespace prism::training {
namespace {

/// gyro924 as the reference normalises it: mean and sd with divisor N.
struct Reference {
  nlohmann::json golden = nlohmann::json::parse(test::read_file(test::golden_dir("composite") / "golden.json"));
  test::Columns train = test::read_columns(test::golden_dir("gyro924") / "train.csv");
  test::Columns test_rows = test::read_columns(test::golden_dir("composite") / "test.csv");
  CompositeSamples samples;
  Eigen::MatrixXd x_test;
  double y_mean = 0, y_sd = 1;

  Reference() {
    const auto n = static_cast<Eigen::Index>(train["y"].size());
    samples.x.resize(3, n);
    x_test.resize(3, static_cast<Eigen::Index>(test_rows["T"].size()));
    const char* const names[] = {"T", "R", "U"};
    for (Eigen::Index i = 0; i < 3; ++i) {
      const Eigen::VectorXd column = test::vector_of(train[names[i]]);
      const double mean = column.mean(), sd = std::sqrt((column.array() - mean).square().mean());
      samples.x.row(i) = (column.array() - mean).transpose() / sd;
      x_test.row(i) = (test::vector_of(test_rows[names[i]]).array() - mean).transpose() / sd;
    }
    const Eigen::VectorXd y = test::vector_of(train["y"]);
    y_mean = y.mean();
    y_sd = std::sqrt((y.array() - y_mean).square().mean());
    samples.y = (y.array() - y_mean) / y_sd;
    samples.time_h = Eigen::VectorXd::LinSpaced(n, 0, static_cast<double>(n - 1)) * 100 / 3600;  // a row in 100 s
    samples.recording.assign(static_cast<std::size_t>(n), 0);
  }

  Eigen::VectorXd weight(const std::string& name) {
    Eigen::VectorXd v = Eigen::VectorXd::Ones(samples.y.size());
    if (name != "weighted") return v;
    for (const Eigen::Index row : golden["low_weight_rows"]) v[row - 1] = 0.1;
    return v;
  }
};

class CompositeGolden : public testing::TestWithParam<const char*> {};

TEST_P(CompositeGolden, EqualsTheReference) {
  Reference r;
  const auto& expected = r.golden["cases"][GetParam()];
  const auto values = [&](const char* key) { return test::vector_of(expected[key].get<std::vector<double>>()); };
  const auto system = CompositeSystem::make(r.samples, values("theta"), r.weight(GetParam()));
  ASSERT_TRUE(system);
  Eigen::VectorXd gradient, variance;
  EXPECT_LT(test::relative(system->objective(&gradient), expected["objective"]), 1e-8);
  EXPECT_LT(test::relative(gradient, values("gradient")), 1e-7);
  EXPECT_LT(test::relative(system->beta(), expected["beta"]), 1e-8);
  const Eigen::VectorXd mean = system->predict(r.x_test, &variance);
  EXPECT_LT(test::relative((mean.array() * r.y_sd + r.y_mean).matrix(), values("mean")), 1e-8);
  EXPECT_LT(test::relative(variance * r.y_sd * r.y_sd, values("model_variance")), 1e-8);
}

INSTANTIATE_TEST_SUITE_P(Cases, CompositeGolden, testing::Values("start", "optimum", "weighted"));

TEST(CompositeSystem, ThePriorOfTheDriftAddsToItsVarianceOnly) {
  Reference r;
  const Eigen::VectorXd theta = test::vector_of(r.golden["cases"]["start"]["theta"].get<std::vector<double>>());
  const auto system = CompositeSystem::make(r.samples, theta, r.weight("start"));
  ASSERT_TRUE(system);
  Eigen::VectorXd open, thermal;
  const double without = system->objective(&open), with = system->objective(&thermal, {0.5, -3});
  EXPECT_NEAR(with - without, 0.5 / 2 * 1 * 1, 1e-12);  // ln s4² is −2
  thermal[6] -= 0.5;
  EXPECT_LT((thermal - open).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(CompositeSearch, EndsBelowThePointWhereTheReferenceStopped) {
  Reference r;
  TuningSettings counted;
  int evaluations = 0;
  counted.progress = [&evaluations](int done, int, const TuningPoint&) { evaluations = done; };
  const auto fit = search_composite(r.samples, {}, {}, counted, Eigen::VectorXd::Ones(r.samples.y.size()));
  ASSERT_TRUE(fit) << fit.error().text();
  EXPECT_LT(fit->objective, r.golden["cases"]["optimum"]["objective"].get<double>());
  EXPECT_GT(evaluations, 4);
  EXPECT_LT(evaluations, 400);
}

/// Two recordings of 9 and 5 samples, with an offset each, a warm-up and weights.
struct TwoRecordings {
  CompositeSamples samples;
  Eigen::VectorXd weight, theta;

  TwoRecordings() : weight(14), theta(9) {
    samples.x.resize(2, 14), samples.y.resize(14), samples.time_h.resize(14);
    for (Eigen::Index i = 0; i < 14; ++i) {
      const double at = static_cast<double>(i);
      samples.x.col(i) << std::sin(at * at), std::cos(3 * at);
      samples.y[i] = std::sin(2 * at) + 0.3 * samples.x(0, i);
      samples.time_h[i] = i < 9 ? 0.3 * at + 0.02 * at * at : 0.5 * (at - 9);
      samples.recording.push_back(i < 9 ? 0 : 1);
      weight[i] = 0.4 + 0.1 * static_cast<double>(i % 5);
    }
    samples.recordings = 2;
    samples.warm_up = 0.5;
    theta << -0.5, 0.4, 1, -1.5, -2, -1, 0.3, -2.5, -0.7;
  }

  /// k(a, b) of theta's kernel.
  double kernel(const Eigen::VectorXd& s, const Eigen::VectorXd& a, const Eigen::VectorXd& b) const {
    const double d0 = a[0] - b[0], d1 = a[1] - b[1], dot = a.dot(b);
    return s[0] * std::exp(-d0 * d0 / (2 * s[1]) - d1 * d1 / (2 * s[2])) + s[3] * dot + s[4] * dot * dot;
  }
  /// The covariance of all samples; the last sums of theta by s.
  Eigen::MatrixXd covariance(const Eigen::VectorXd& s) const {
    Eigen::MatrixXd h(14, 14);
    for (Eigen::Index i = 0; i < 14; ++i) {
      for (Eigen::Index j = 0; j < 14; ++j) {
        h(i, j) = kernel(s, samples.x.col(i), samples.x.col(j)) +
                  samples.warm_up * std::exp(-samples.time_h[i] - samples.time_h[j]);
        if ((i < 9) == (j < 9))
          h(i, j) += s[5] * std::exp(-std::abs(samples.time_h[i] - samples.time_h[j]) / s[6]) + s[8];
      }
      h(i, i) += s[7] / weight[i] + 1e-8;
    }
    return h;
  }
  /// The contract of objective(), by an inverse and a determinant.
  double objective(const Eigen::VectorXd& logs, const DriftPrior& drift) const {
    const Eigen::MatrixXd h = covariance(logs.array().exp()), inverse = h.inverse();
    const Eigen::VectorXd ones = Eigen::VectorXd::Ones(14);
    const double information = ones.dot(inverse * ones), beta = ones.dot(inverse * samples.y) / information;
    const Eigen::VectorXd alpha = inverse * (samples.y - beta * ones);
    return 0.5 * std::log(h.determinant()) + 0.5 * std::log(information) + 0.5 * samples.y.dot(alpha) +
           0.005 * logs.squaredNorm() + drift.weight * std::pow(logs[5] - drift.centre, 2) / 2;
  }
};

TEST(CompositeSystem, OfSeveralRecordingsIsThatOfTheCompleteMatrices) {
  const TwoRecordings r;
  const DriftPrior drift{0.5, -3};
  const auto system = CompositeSystem::make(r.samples, r.theta, r.weight);
  ASSERT_TRUE(system);
  Eigen::VectorXd gradient, variance;
  EXPECT_NEAR(system->objective(&gradient, drift), r.objective(r.theta, drift), 1e-9);
  EXPECT_EQ(system->objective(nullptr, drift), system->objective(&gradient, drift));
  for (Eigen::Index i = 0; i < 9; ++i) {
    Eigen::VectorXd up = r.theta, down = r.theta;
    up[i] += 1e-5, down[i] -= 1e-5;
    EXPECT_NEAR(gradient[i], (r.objective(up, drift) - r.objective(down, drift)) / 2e-5, 1e-6) << i;
  }
  const Eigen::VectorXd s = r.theta.array().exp(), ones = Eigen::VectorXd::Ones(14);
  const Eigen::MatrixXd inverse = r.covariance(s).inverse();
  const double information = ones.dot(inverse * ones), beta = ones.dot(inverse * r.samples.y) / information;
  const Eigen::VectorXd alpha = inverse * (r.samples.y - beta * ones);
  EXPECT_NEAR(system->beta(), beta, 1e-10);
  EXPECT_LT((system->alpha() - alpha).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((system->residual() - s[7] * alpha.cwiseQuotient(r.weight)).cwiseAbs().maxCoeff(), 1e-10);
  Eigen::MatrixXd at(2, 3);
  at << 0, 0.5, -3, 0, -0.25, 4;
  const Eigen::VectorXd mean = system->predict(at, &variance);
  for (Eigen::Index i = 0; i < 3; ++i) {
    Eigen::VectorXd k(14);
    for (Eigen::Index j = 0; j < 14; ++j) k[j] = r.kernel(s, r.samples.x.col(j), at.col(i));
    const double level = 1 - ones.dot(inverse * k);
    EXPECT_NEAR(mean[i], k.dot(alpha) + beta, 1e-9);
    EXPECT_NEAR(variance[i], r.kernel(s, at.col(i), at.col(i)) - k.dot(inverse * k) + level * level / information,
                1e-9);
  }
}

TEST(CompositeSystem, ItsParametersAreTheirLogarithms) {
  const TwoRecordings r;
  const auto v = composite_variances(r.theta, 2);
  const Eigen::VectorXd s = r.theta.array().exp();
  EXPECT_EQ(v.kernel.rbf, s[0]);
  EXPECT_EQ(v.kernel.length2, s.segment(1, 2));
  EXPECT_EQ(v.kernel.linear, s[3]);
  EXPECT_EQ(v.kernel.quadratic, s[4]);
  EXPECT_EQ(v.nuisance, s[5]);
  EXPECT_EQ(v.nuisance_time_h, s[6]);
  EXPECT_EQ(v.noise, s[7]);
  EXPECT_EQ(v.offset, s[8]);
  EXPECT_LT((composite_theta(v, true) - r.theta).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LT((composite_theta(v, false) - r.theta.head(8)).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_EQ(composite_variances(r.theta.head(8), 2).offset, 0);
  const CompositeSamples part = r.samples.part({1, 8, 9});
  EXPECT_EQ(part.x, r.samples.x(Eigen::all, Rows{1, 8, 9}));
  EXPECT_EQ(part.y, r.samples.y(Rows{1, 8, 9}));
  EXPECT_EQ(part.time_h, r.samples.time_h(Rows{1, 8, 9}));
  EXPECT_EQ(part.recording, (std::vector{0, 0, 1}));
  EXPECT_EQ(part.recordings, 2);
  EXPECT_EQ(part.warm_up, 0.5);
  // Rows with a weight below 0.3 do not count: of 1, 2 and 3.
  EXPECT_DOUBLE_EQ(believed_sd(Eigen::Vector4d(1, 2, 3, 100), Eigen::Vector4d(1, 0.3, 1, 0.29)), std::sqrt(2.0 / 3));
}

// f ≈ wᵀ φ(x) over the centres: a covariance Kₙᵣ Kᵣᵣ⁻¹ Kᵣₙ instead of K, so that alpha = Kᵣᵣ⁻¹ Kᵣₙ C⁻¹ (y − beta).
TEST(SparseComposite, IsTheNystromCovarianceOfItsCentres) {
  TwoRecordings r;
  r.samples.warm_up = 0;  // dense models only
  ReweightSettings settings{.weight = {WeightKind::kMyriad}};
  for (const Eigen::Index most : {14, 4}) {
    const auto sparse = solve_sparse_composite(r.samples, r.theta, settings, most);
    ASSERT_TRUE(sparse);
    EXPECT_TRUE(sparse->reweight.converged);
    const auto n = std::ssize(sparse->centres);
    EXPECT_TRUE(most == 4 ? n == 4 : n > 4);
    r.weight = sparse->weight;
    const Eigen::VectorXd s = r.theta.array().exp(), ones = Eigen::VectorXd::Ones(14);
    Eigen::MatrixXd across(14, n), own(n, n);
    for (Eigen::Index j = 0; j < n; ++j) {
      const Eigen::VectorXd centre = r.samples.x.col(sparse->centres[static_cast<std::size_t>(j)]);
      EXPECT_EQ(sparse->parameters.centres.col(j), centre);
      for (Eigen::Index i = 0; i < 14; ++i) across(i, j) = r.kernel(s, r.samples.x.col(i), centre);
      for (Eigen::Index i = 0; i < n; ++i)
        own(i, j) = r.kernel(s, r.samples.x.col(sparse->centres[static_cast<std::size_t>(i)]), centre);
      own(j, j) += 1e-8 * s[0];
    }
    Eigen::MatrixXd rest = r.covariance(s);  // without the kernel
    for (Eigen::Index i = 0; i < 14; ++i) {
      for (Eigen::Index j = 0; j < 14; ++j) rest(i, j) -= r.kernel(s, r.samples.x.col(i), r.samples.x.col(j));
    }
    const Eigen::MatrixXd inverse = (across * own.inverse() * across.transpose() + rest).inverse();
    const double beta = ones.dot(inverse * r.samples.y) / ones.dot(inverse * ones);
    const Eigen::VectorXd alpha = own.inverse() * across.transpose() * inverse * (r.samples.y - beta * ones);
    EXPECT_NEAR(sparse->parameters.beta, beta, 1e-6);
    EXPECT_LT((across * (sparse->parameters.alpha - alpha)).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_LT((sparse->fitted - across * alpha - beta * ones).cwiseAbs().maxCoeff(), 1e-6);
    Eigen::MatrixXd psi(n + 1, 14);
    psi << Eigen::MatrixXd(own.llt().matrixL().solve(across.transpose())), ones.transpose();
    Eigen::MatrixXd gram = psi * rest.inverse() * psi.transpose();
    gram.diagonal().head(n).array() += 1;
    EXPECT_LT((sparse->parameters.gram - gram).cwiseAbs().maxCoeff(), 1e-5 * gram.maxCoeff());
  }
}

// A row in 20 pieces of the record: up by 1, then back. The path must be shorter than the range / 0.75.
TEST(OnePassage, IsARangeOfThreeQuartersOfThePath) {
  const auto passes = [](int up, double back, const std::string& name = "T") {
    TrainingData data;
    data.names = {"U", name};
    data.inputs = Eigen::MatrixXd::Zero(2, 40);
    double t = 0;
    for (int i = 0; i < 20; ++i) {
      t += i == 0 ? 0 : i <= up ? 1 : -back / (19 - up);
      data.inputs.col(2 * i)[1] = t + 0.25, data.inputs.col(2 * i + 1)[1] = t - 0.25;
    }
    data.target = Eigen::VectorXd::Zero(40);
    return data;
  };
  EXPECT_TRUE(one_passage(passes(19, 0)));
  EXPECT_TRUE(one_passage(passes(15, 4.9)));
  EXPECT_FALSE(one_passage(passes(15, 5)));
  EXPECT_FALSE(one_passage(passes(15, 0, "dTdt"))) << "the first input is constant";
  TrainingData data = passes(19, 0);
  data.names = {"case", "pcb"};
  data.inputs.row(0).swap(data.inputs.row(1));
  EXPECT_TRUE(one_passage(data)) << "the first input, if none is named T";
  data.runs.assign(40, 0);
  EXPECT_TRUE(one_passage(data));
  data.runs.back() = 1;
  EXPECT_FALSE(one_passage(data)) << "of several recordings";
  data.runs.clear();
  data.inputs.conservativeResize(2, 39);
  EXPECT_FALSE(one_passage(data)) << "two rows for each piece";
}

// Of 195 rows or more; at most a quarter of them. 9 noises are far enough, 6 are not.
TEST(FirstWeights, AreLowForRowsFarFromTheirNeighbours) {
  const auto weights = [](Eigen::Index rows, Eigen::Index every, double noises, WeightKind kind) {
    TrainingData data = test::record({"T"}, rows, [](double i, double* t) {
      *t = std::sin(i / 9);
      return 0.001 * std::sin(i * i);
    });
    for (Eigen::Index i = 5; i < rows; i += every) data.target[i] = 0.001 * noises;
    TrainingSettings settings;
    settings.reweight.weight.kind = kind;
    const Eigen::VectorXd weight = first_weights(data, settings);
    std::vector<Eigen::Index> low;
    for (Eigen::Index i = 0; i < rows; ++i) {
      if (weight[i] != 1) low.push_back(i);
      EXPECT_TRUE(weight[i] == 1 || weight[i] == kMinCompositeWeight);
    }
    return low;
  };
  EXPECT_EQ(weights(195, 50, 9, WeightKind::kMyriad), (std::vector<Eigen::Index>{5, 55, 105, 155}));
  EXPECT_TRUE(weights(195, 50, 5, WeightKind::kMyriad).empty());
  EXPECT_TRUE(weights(194, 50, 9, WeightKind::kMyriad).empty());
  EXPECT_TRUE(weights(195, 50, 9, WeightKind::kNone).empty());
  EXPECT_EQ(weights(200, 4, 30, WeightKind::kMyriad).size(), 49u);
  EXPECT_TRUE(weights(200, 3, 30, WeightKind::kMyriad).empty()) << "more than a quarter";
}

TEST(DriftPriors, AreThoseOfTheUsersKnowledge) {
  EXPECT_EQ(drift_prior(Drift::kThermal).weight, 0.25);
  EXPECT_EQ(drift_prior(Drift::kThermal).centre, std::log(0.05));
  EXPECT_EQ(drift_prior(Drift::kNone).weight, 100);
  EXPECT_EQ(drift_prior(Drift::kNone).centre, std::log(1e-6));
  EXPECT_EQ(drift_prior(Drift::kOpen).weight, 0);
  EXPECT_EQ(drift_prior(Drift::kOpen).centre, 0);
}

/// y = truth(T, U) + drift in time + noise, with some outliers; with the times of a chamber cycle.
struct DriftingRecord {
  TrainingData data;
  std::mt19937_64 random{11};
  std::normal_distribution<double> normal;

  static double truth(double t, double u) { return 0.3 + 0.02 * std::tanh(t / 20) + 0.05 * (u - 5.5); }

  explicit DriftingRecord(Eigen::Index n, double drift = 0, double outliers = 0) {
    data.names = {"T", "U"};
    data.inputs.resize(2, n);
    data.target.resize(n);
    data.time_s.resize(n);
    double walk = 0;
    for (Eigen::Index i = 0; i < n; ++i) {
      const double at = static_cast<double>(i) / static_cast<double>(n), t = 60 * std::sin(20 * at),
                   u = 5.5 + 0.1 * std::cos(12.4 * at);
      walk = 0.98 * walk + 0.2 * drift * normal(random);
      data.inputs.col(i) << t, u;
      data.time_s[i] = 92400 * at;
      data.target[i] = truth(t, u) + walk + 0.001 * normal(random) + (i % 31 == 7 ? outliers : 0);
    }
    data.runs.assign(static_cast<std::size_t>(n), 0);
  }
};

TrainedModel composite_of(const TrainingData& data, Drift drift = Drift::kThermal) {
  TrainingSettings settings;
  settings.drift = drift;
  return test::trained(data, settings);
}

// Errors over a grid within the data, with the default policy, in deg/h: rms, and the fraction within 2 sd.
std::pair<double, double> judged(const compensation::Model& model) {
  double squares = 0, covered = 0, count = 0;
  for (double t = -50; t <= 50; t += 5) {
    for (double u = 5.45; u < 5.56; u += 0.02, ++count) {
      const auto p = test::served(model, {t, u});
      const double error = p.bias_deg_per_h - DriftingRecord::truth(t, u);
      squares += error * error;
      covered += std::fabs(error) < 2 * p.sd_deg_per_h;
    }
  }
  return {std::sqrt(squares / count), covered / count};
}

TEST(CompositeTrainer, FindsTheTruthDespiteOutliersWithAValidDeviation) {
  const auto model = composite_of(DriftingRecord(400, 0, 0.2).data);
  const auto [rms, covered] = judged(*model.model);
  EXPECT_LT(rms, 0.001);
  EXPECT_GT(covered, 0.9);
  EXPECT_LT(model.samples.weight[7], 0.01);
}

// Outliers of 10 and 30 noises were part of the noise and of the drift that the model states, and judged the skill: its
// sd was up to eight times the clean one.
TEST(CompositeTrainer, OutliersAreNeitherNoiseNorDriftNorMissingSkill) {
  constexpr double kNoise = 0.005;
  DriftingRecord clean(400, 0.001);
  for (double& target : clean.data.target) target += kNoise * clean.normal(clean.random);
  TrainingData isolated = clean.data, bursts = clean.data;
  for (Eigen::Index i = 0; i < 400; ++i) {
    if (i % 10 == 3) isolated.target[i] += kNoise * (i % 20 == 3 ? 10 : -10);
    if (i % 80 >= 70 && i % 80 < 78) bursts.target[i] += 30 * kNoise;
  }
  const auto known = [](const TrainingData& data) {
    return *composite_of(data).model->predict(std::vector{10.0, 5.5}).knowledge;
  };
  const auto expected = known(clean.data);
  for (const TrainingData* data : {&isolated, &bursts}) {
    const auto found = known(*data);
    EXPECT_NEAR(found.spread.noise_deg_per_h / expected.spread.noise_deg_per_h, 1, 0.2);
    EXPECT_LT(found.spread.nuisance_deg_per_h, 1.3 * expected.spread.nuisance_deg_per_h);
    EXPECT_GT(compensation::evidence_of(found.skill, found.overlap), compensation::kFullSkill);
  }
}

// Drift in time is not modelled as structure: it is part of the sd, and the noise is part of sd_mean.
TEST(CompositeTrainer, IncludesTheDriftInItsStandardDeviation) {
  const auto still = composite_of(DriftingRecord(400).data), drifting = composite_of(DriftingRecord(400, 0.005).data);
  const std::vector<double> at = {10, 5.5};
  const auto a = still.model->predict(at), b = drifting.model->predict(at);
  EXPECT_GT(b.sd_deg_per_h * b.sd_deg_per_h - a.sd_deg_per_h * a.sd_deg_per_h, 0.004 * 0.004);
  EXPECT_GT(judged(*drifting.model).second, 0.9);
  EXPECT_NEAR(std::hypot(a.sd_deg_per_h, 0.001), a.sd_mean_deg_per_h, 2e-4);
}

// One passage: the temperature rises with time, so the drift could explain everything.
TrainingData passage(double drift) {
  DriftingRecord record(200, drift);
  for (Eigen::Index i = 0; i < 200; ++i) {
    const double at = static_cast<double>(i) / 200, t = 60 - 100 * std::exp(-3 * at);
    record.data.target[i] += DriftingRecord::truth(t, record.data.inputs(1, i)) -
                             DriftingRecord::truth(record.data.inputs(0, i), record.data.inputs(1, i));
    record.data.inputs(0, i) = t;
  }
  return record.data;
}

double drift_of(const TrainedModel& trained) {
  return static_cast<const compensation::CompositeModel&>(*trained.model).parameters().variances.nuisance;
}

TEST(CompositeTrainer, DoesNotLetTheDriftTakeWhatTemperatureExplains) {
  const TrainingData data = passage(0.001);
  const auto thermal = composite_of(data);
  EXPECT_LT(drift_of(thermal), 0.3);
  EXPECT_GT(drift_of(thermal), 0.01);
  EXPECT_LT(drift_of(composite_of(data, Drift::kNone)), 1e-4);
  ASSERT_EQ(thermal.notes.size(), 1u);
  EXPECT_EQ(thermal.notes[0].find("one passage through the temperatures: "), 0u);
  EXPECT_TRUE(composite_of(data, Drift::kOpen).notes.empty());
  EXPECT_TRUE(composite_of(DriftingRecord(400, 0.002).data).notes.empty()) << "several passages";
}

// Three days that begin at the same inputs, each with the same warm-up: it is not a thermal bias at these inputs.
TEST(CompositeTrainer, SeveralLongRecordingsShareTheirWarmUp) {
  const TrainingData one = DriftingRecord(90).data;
  TrainingData days = test::record(one.names, 270, [&one](double i, double* x) {
    const Eigen::Index row = static_cast<Eigen::Index>(i) % 90;
    x[0] = one.inputs(0, row), x[1] = one.inputs(1, row);
    return one.target[row] + 0.03 * std::exp(-one.time_s[row] / 3600) + 1e-3 * std::sin(70.0 * i);
  });
  days.time_s = one.time_s.replicate(3, 1);
  for (int day = 0; day < 3; ++day) days.runs.insert(days.runs.end(), 90, day);
  const auto model = composite_of(days).model;
  const auto& p = static_cast<const compensation::CompositeModel&>(*model).parameters();
  EXPECT_EQ(p.variances.warm_up, 0.5);
  EXPECT_NEAR(model->predict(std::vector{0.0, 5.6}).bias_deg_per_h, DriftingRecord::truth(0, 5.6), 0.004);
  test::read_back(*model, {{3, 5.5}});
  days.time_s /= 10;  // too short to tell a warm-up from temperature
  const auto brief = composite_of(days).model;
  EXPECT_EQ(static_cast<const compensation::CompositeModel&>(*brief).parameters().variances.warm_up, 0);
}

// A file of version 0.2 has neither overlap nor relevance: its predictions follow the policy of that version.
TEST(CompositeTrainer, ReadsModelsOfTheVersionBefore) {
  const auto model = composite_of(DriftingRecord(120, 0.002).data).model;
  const auto& now = static_cast<const compensation::CompositeModel&>(*model);
  compensation::CompositeParameters p = now.parameters();
  EXPECT_EQ(p.trust.relevance.size(), 2u);
  p.trust.relevance.clear();
  p.trust.overlap = 1;
  const auto made = compensation::CompositeModel::make(now.info(), std::move(p));
  ASSERT_TRUE(made) << made.error().text();
  EXPECT_EQ(compensation::format_model(**made).find("overlap"), std::string::npos);
  const auto old = test::read_back(**made, {});
  EXPECT_NE(old->info().id, now.info().id);
  const auto at = old->predict(std::vector{90.0, 5.5});
  EXPECT_FALSE(at.knowledge->edge);
  EXPECT_NEAR(at.knowledge->excess, 30.0 / 120, 0.01);
  EXPECT_EQ(at.bias_deg_per_h, now.predict(std::vector{90.0, 5.5}).bias_deg_per_h);
}

// If a bias rises with T in one half of the record and falls in the other, the model is not used: it predicts the mean
// of the rows that its weights believe.
TEST(CompositeTrainer, ShrinksARecordThatContradictsItself) {
  DriftingRecord drift(400);
  for (Eigen::Index i = 200; i < 400; ++i) drift.data.target[i] = 0.6 - drift.data.target[i];
  const auto model = composite_of(drift.data);
  const auto& m = static_cast<const compensation::CompositeModel&>(*model.model);
  EXPECT_LE(m.parameters().trust.skill, 0);
  const auto p = test::served(m, {40, 5.5});
  const Eigen::ArrayXd believed = (model.samples.weight.array() >= kBelievedWeight).cast<double>();
  EXPECT_LT(believed.minCoeff(), 1);
  // 1e-4: the last solve, on the target without these rows, changes the weights once more.
  EXPECT_NEAR(p.bias_deg_per_h, (believed * drift.data.target.array()).sum() / believed.sum(), 1e-4);
  EXPECT_DOUBLE_EQ(p.bias_deg_per_h, m.parameters().normalisation.target_shift);
}

TEST(CompositeTrainer, ItsFileReadsBackAsTheSameModel) {
  test::read_back(*composite_of(DriftingRecord(120, 0.002, 0.1).data).model, {{-70, 5.52}, {0, 5.52}, {33, 5.52}});
}

// On the last 97 rows the likelihood has three optima. The best without weights has no noise and loses 30 % on the rows
// before; with weights its likelihood is 67 lower than that of another, which improves them by 22 %.
TEST(CompositeTrainer, ComparesOptimaOfTheLikelihoodWithTheirWeights) {
  auto columns = test::read_columns(test::golden_dir("chamber141") / "blocks.csv");
  const auto n = static_cast<Eigen::Index>(columns["B"].size());
  constexpr Eigen::Index kBefore = 44;
  Eigen::MatrixXd inputs(2, n);
  inputs.row(0) = test::vector_of(columns["T"]).transpose();
  inputs.row(1) = test::vector_of(columns["dTdt"]).transpose();
  const Eigen::VectorXd target = test::vector_of(columns["B"]);
  TrainingData data;
  data.names = {"T", "dTdt"};
  data.inputs = inputs.rightCols(n - kBefore);
  data.target = target.tail(n - kBefore);
  data.time_s = test::vector_of(columns["t"]).tail(n - kBefore);
  data.runs.assign(static_cast<std::size_t>(n - kBefore), 0);
  const auto model = composite_of(data).model;
  double before = 0, after = 0;
  for (Eigen::Index i = 0; i < kBefore; ++i) {
    const auto p = test::served(*model, {inputs(0, i), inputs(1, i)});
    before += std::pow(target[i] - data.target.mean(), 2);
    after += std::pow(target[i] - p.bias_deg_per_h, 2);
  }
  EXPECT_GT(1 - std::sqrt(after / before), 0.1);
}

// Few centres and the filter, compared with one centre per sample: the same model, with a difference well below its sd.
TEST(CompositeTrainer, LongRecordsBecomeSparseModelsWithEqualPredictions) {
  const auto sparse = composite_of(DriftingRecord(6000, 0.002, 0.1).data);
  EXPECT_LT(sparse.centres, 400);
  const auto [rms, covered] = judged(*sparse.model);
  EXPECT_LT(rms, 0.002);
  EXPECT_GT(covered, 0.9);
  test::read_back(*sparse.model, {{1, 5.5}});
}

TEST(SparseComposite, EqualsTheDenseSystemWithManyCentres) {
  const DriftingRecord drift(300, 0.002);
  const auto data = normalise(drift.data, NormalisationMethod::kZscore);
  const CompositeSamples samples{data->x, data->y, drift.data.time_s / 3600, std::vector<int>(300, 0), 1};
  Eigen::VectorXd theta(8);
  theta << -1, 0.3, 0.7, -1, -2, -3, 0.5, -3;
  const Eigen::VectorXd weight = Eigen::VectorXd::Ones(300);
  const auto dense = CompositeSystem::make(samples, theta, weight);
  const auto sparse = solve_sparse_composite(samples, theta, {}, 300);
  ASSERT_TRUE(dense && sparse);
  EXPECT_LT(sparse->centres.size(), 200u);
  compensation::CompositeCentres centres(compensation::CompositeKernel(composite_variances(theta, 2).kernel),
                                         samples.x(Eigen::all, sparse->centres));
  centres.weigh(sparse->parameters.alpha);
  const Eigen::MatrixXd some = samples.x.leftCols(50);
  const Eigen::VectorXd expected = dense->predict(some);
  for (Eigen::Index i = 0; i < 50; ++i)
    EXPECT_NEAR(centres.sum(some.col(i)) + sparse->parameters.beta, expected[i], 2e-3);
}

TEST(SparseComposite, ASolutionThatIsNotFiniteIsNone) {
  CompositeSamples samples;
  samples.x = Eigen::RowVectorXd::LinSpaced(30, -1, 1);
  samples.y = samples.x.transpose().cwiseAbs2();
  samples.time_h = Eigen::VectorXd::LinSpaced(30, 0, 1);
  samples.recording.assign(30, 0);
  Eigen::VectorXd theta(7);
  theta << -1, 0.3, -1, -2, -3, 0.5, -3;
  EXPECT_TRUE(solve_sparse_composite(samples, theta, {}, 10));
  samples.y *= 1e308;
  EXPECT_FALSE(solve_sparse_composite(samples, theta, {}, 10));
}

// The filter compared with the equivalent matrix, for two recordings with an offset each.
TEST(NuisanceFilter, IsTheInverseOfTheNuisanceMatrix) {
  compensation::CompositeVariances v;
  v.nuisance = 0.7, v.nuisance_time_h = 0.4, v.offset = 0.3, v.noise = 0.2;
  Eigen::VectorXd time_h(40), weight(40), y(40);
  std::vector<int> recording;
  for (Eigen::Index i = 0; i < 40; ++i) {
    time_h[i] = 0.05 * static_cast<double>(i % 25) * (1 + 0.01 * static_cast<double>(i));
    weight[i] = 0.5 + 0.1 * static_cast<double>(i % 7);
    y[i] = std::sin(3.0 * static_cast<double>(i));
    recording.push_back(i < 25 ? 0 : 1);
  }
  Eigen::MatrixXd h = compensation::nuisance_matrix(v, time_h, recording);
  h.diagonal().array() += v.noise / weight.array() + compensation::kCompositeJitter;
  const NuisanceFilter filter(v, time_h, recording, weight);
  const Eigen::VectorXd expected = h.ldlt().solve(y);
  EXPECT_LT((filter.solve(y) - expected).cwiseAbs().maxCoeff(), 1e-12);
  NuisanceFilter::Carry carry(1);
  Eigen::MatrixXd first = y.head(17).transpose(), second = y.tail(23).transpose();
  filter.whiten(first, 0, carry);
  filter.whiten(second, 17, carry);
  EXPECT_NEAR(first.squaredNorm() + second.squaredNorm(), y.dot(expected), 1e-11);
}

}  // namespace
}  // namespace prism::training
