// SPDX-License-Identifier: MIT
// Models compared with hand calculations: bias, standard deviation, guard, policies, and their files.
#include "compensation/polynomial_model.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <bit>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "compensation/extrapolation.hpp"
#include "compensation/kernel.hpp"
#include "compensation/lssvm_model.hpp"
#include "compensation/model_text.hpp"
#include "tests/support/models.hpp"
#include "tests/support/shared_files.hpp"

namespace prism::compensation {
namespace {

constexpr double kRounding = 1e-15;  // sums of nine doubles below 4

ModelPtr shipped(const std::string& name) {
  const auto path = std::filesystem::path(PRISM_SOURCE_DIR) / "config" / "models" / name;
  auto model = parse_model(test::read_file(path), name);
  EXPECT_TRUE(model) << model.error().text();
  return model ? *model : nullptr;
}

double bias(const ModelPtr& model, std::vector<double> inputs) { return model->predict(inputs).bias_deg_per_h; }

// T = 25 degC, dT/dt = 0.01 degC/s, term by term of equation 23:
//   -0.001427
//   +0.0004906   · 25        = +0.012265
//   -0.000004616 · 625       = -0.002885
//   -0.917       · 0.01      = -0.00917
//   -57.349      · 0.0001    = -0.0057349
//   -0.01926     · 25 · 0.01 = -0.004815
//                        sum = -0.0117669
// At T = 0 and dT/dt = 0 only the constant remains.
TEST(ShippedModels, Model1IsEquation23) {
  const ModelPtr model = shipped("tao2019-model1.json");
  ASSERT_TRUE(model);
  EXPECT_EQ(model->info().inputs, (std::vector<std::string>{"T", "dTdt"}));
  EXPECT_EQ(model->info().kind, "stepwise");
  EXPECT_EQ(model->info().features, FeatureDefinition{}) << "the sampling of the paper";
  EXPECT_EQ(model->info().gyro_serial, "") << "of any gyro";
  EXPECT_NEAR(bias(model, {25, 0.01}), -0.0117669, kRounding);
  EXPECT_EQ(bias(model, {0, 0}), -0.001427);
  EXPECT_FALSE(model->predict(std::vector<double>{1000, 1000}).extrapolating);
}

// T = 20 degC, dT/dt = -0.01 degC/s, U = 5.25 V, term by term of equation 25:
//   -1.565
//   +0.008292    · 20           = +0.16584
//   +0.000005529 · 400          = +0.0022116
//   +26.263      · -0.01        = -0.26263
//   +0.646       · 5.25         = +3.3915
//   -0.06494     · 27.5625      = -1.78990875
//   -0.04055     · 20 · -0.01   = +0.00811
//   -0.001562    · 20 · 5.25    = -0.16401
//   -4.666       · -0.01 · 5.25 = +0.244965
//                           sum = +0.03107785
TEST(ShippedModels, Model2IsEquation25) {
  const ModelPtr model = shipped("tao2019-model2.json");
  ASSERT_TRUE(model);
  EXPECT_EQ(model->info().inputs, (std::vector<std::string>{"T", "dTdt", "U"}));
  EXPECT_NEAR(bias(model, {20, -0.01, 5.25}), 0.03107785, 4 * kRounding);
  EXPECT_EQ(bias(model, {0, 0, 0}), -1.565);
}

// 2 - 3 x + 5 x³ at x = -2: 2 + 6 - 40 = -32 (the paper's equation 21 has this form).
TEST(PolynomialModel, TakesAnyPowerOfOneInput) {
  ModelInfo info;
  info.kind = "polynomial";
  info.inputs = {"T"};
  const PolynomialModel model(info, {{{0}, 2}, {{1}, -3}, {{3}, 5}});
  EXPECT_EQ(model.predict(std::vector<double>{-2}).bias_deg_per_h, -32);
  EXPECT_TRUE(std::isnan(model.predict(std::vector<double>{-2}).sd_deg_per_h));
  EXPECT_EQ(PolynomialModel(info, {}).predict(std::vector<double>{25}).bias_deg_per_h, 0) << "without terms";
}

TEST(PolynomialModel, TheDomainIsClosedAndIncludesEveryInput) {
  const ModelPtr model = test::linear_model({"T", "U"}, {0, 0}, 1, {}, Domain{{-40, 5}, {70, 6}});
  for (const auto& inside : {std::vector<double>{-40, 5}, {70, 6}}) EXPECT_FALSE(model->predict(inside).extrapolating);
  for (const auto& outside : {std::vector<double>{-40.001, 5.5}, {70.001, 5.5}, {25, 4.999}, {25, 6.001}})
    EXPECT_TRUE(model->predict(outside).extrapolating) << outside[0] << ' ' << outside[1];
}

TEST(GatherInputs, ReturnsThemInTheOrderOfTheModelOrNothing) {
  const ModelPtr model = test::linear_model({"U", "T"}, {1, 1});
  Window window;
  window.temperature_degc = 25;
  EXPECT_TRUE(gather_inputs(*model, window).empty());
  window.uhfo_v = 5.25;
  EXPECT_EQ(gather_inputs(*model, window), (std::vector<double>{5.25, 25}));
}

// A prediction of 5 over a mean of 1, of a model without uncertainty at this point.
Prediction predicted(double skill, double overlap) {
  Prediction p;
  p.bias_deg_per_h = 5;
  p.mean_deg_per_h = 1;
  p.knowledge = {0, 4, skill, 0, {}, true, overlap, PredictiveUncertainty::Edge{5, 0}};
  return p;
}

TEST(Shrunk, DistinguishesHalvesThatAgreeDisagreeAndDoNotOverlap) {
  EXPECT_EQ(shrunk(predicted(0.7, 1)).bias_deg_per_h, 5) << "overlap and agree";
  EXPECT_EQ(shrunk(predicted(0.05, 1)).bias_deg_per_h, 1) << "overlap and disagree";
  EXPECT_EQ(shrunk(predicted(-3, 0.5)).bias_deg_per_h, 1) << "what overlaps disagrees";
  EXPECT_NEAR(shrunk(predicted(0.05, 0.5)).bias_deg_per_h, 1 + 4 * (0.05 + 0.45 - 0.1) / 0.5, 1e-12)
      << "do not overlap: no evidence against the model";
  EXPECT_GT(shrunk(predicted(0.05, 0.5)).sd_deg_per_h, shrunk(predicted(0.7, 1)).sd_deg_per_h);
}

TEST(Shrunk, KeepsTheBiasOfTheEdgeBeyondIt) {
  Prediction far = predicted(1, 1);
  far.knowledge->edge = PredictiveUncertainty::Edge{3, 0};
  far.knowledge->excess = 10;
  far.knowledge->model_variance = 40;  // ten times the target's
  const double e = 9.85 * 9.85, at_edge = 1 / (1 + 5 + e / 2), beyond = 1 / (1 + 10 + 10 * e);
  EXPECT_NEAR(shrunk(far).bias_deg_per_h, 1 + at_edge * 2 + beyond * 2, 1e-12);
  far.knowledge->excess = 0.15;  // near: the edge's own certainty counts
  EXPECT_NEAR(shrunk(far).bias_deg_per_h, 1 + 2 / 6.0 + 2 / 11.0, 1e-12);
  Prediction inside = predicted(1, 1);
  EXPECT_GT(shrunk(far).sd_deg_per_h, shrunk(inside).sd_deg_per_h);
}

// f = 5 beyond an edge of b = 3 and v_b = 0.4, mean 1, var_y = 4, v = 26, o = 0.35: e = 0.04 and (v − v_b)/var_y − 5
// = 1.4.
TEST(Shrunk, StatesTheErrorOfBothParts) {
  Prediction p = predicted(0.3, 0.75);
  p.knowledge->spread = {0.5, 0.25, 2, 1.5};
  p.knowledge->edge = PredictiveUncertainty::Edge{3, 0.4};
  p.knowledge->excess = 0.35;
  p.knowledge->model_variance = 26;
  const double g = (0.3 + 0.9 * 0.25 - 0.1) / 0.5, at_edge = g / (1 + 0.1 + 1.4 + 0.02), beyond = g / (1 + 6.5 + 0.4);
  const double lost = (1 - at_edge) * (4 + 4) + (1 - beyond) * 4 + 0.5 * 0.35 * 4;
  const double variance = 1.25 * (26 + 0.25 + lost) + 0.0625;
  const Prediction found = shrunk(p);
  EXPECT_NEAR(found.bias_deg_per_h, 1 + 2 * at_edge + 2 * beyond, 1e-12);
  EXPECT_NEAR(found.sd_deg_per_h, 1.5 * std::sqrt(variance), 1e-12);
  EXPECT_NEAR(found.sd_mean_deg_per_h, 1.5 * std::sqrt(variance + 4), 1e-12);
  p.knowledge->model_variance = 20.4;  // exactly 5 above that of the edge, in units of var_y
  EXPECT_NEAR(shrunk(p).bias_deg_per_h, 1 + 2 * g / (1 + 0.1 + 0.02) + 2 * g / (1 + 5.1 + 0.4), 1e-12);
  p.knowledge.reset();
  EXPECT_EQ(shrunk(p).bias_deg_per_h, 5) << "without knowledge";
}

// Models of version 0.2 have no edge: their policy stays.
TEST(Shrunk, ServesOlderModelsAsBefore) {
  Prediction old = predicted(0.35, 1);
  old.knowledge->edge.reset();
  old.knowledge->excess = 0.65;
  old.knowledge->model_variance = 2;
  const double w = 0.5 / (1 + 0.5 + 20 * 0.25);
  const Prediction p = shrunk(old);
  EXPECT_NEAR(p.bias_deg_per_h, 1 + 4 * w, 1e-12);
  EXPECT_NEAR(p.sd_deg_per_h, std::sqrt(1.25 * (2 + (1 - w) * (4 + 16))), 1e-12);
}

ModelInfo info_of(Eigen::Index inputs) {
  ModelInfo info;
  info.kind = "ir_lssvm";
  info.provenance_json = "{}";
  const char* names[] = {"T", "dTdt", "U"};
  for (Eigen::Index i = 0; i < inputs; ++i) info.inputs.push_back(names[i]);
  return info;
}

LssvmParameters random_parameters(Eigen::Index d, Eigen::Index n) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  LssvmParameters p;
  p.centres = Eigen::MatrixXd::NullaryExpr(d, n, [&] { return normal(random); });
  p.alpha = Eigen::VectorXd::NullaryExpr(n, [&] { return normal(random); });
  p.alpha.array() -= p.alpha.mean();
  p.weight = Eigen::VectorXd::NullaryExpr(n, [&] { return 0.1 + 0.9 * std::fabs(std::sin(normal(random))); });
  p.b = 0.3;
  p.c = 20;
  p.sigma2 = 0.7;
  p.normalisation.input_shift = Eigen::VectorXd::LinSpaced(d, 1, 2);
  p.normalisation.input_scale = Eigen::VectorXd::LinSpaced(d, 3, 4);
  p.normalisation.target_shift = 0.01;
  p.normalisation.target_scale = 0.02;
  p.uncertainty = LssvmUncertainty{2.5, 1.5, 0.3, {}};
  return p;
}

ModelPtr made(ModelInfo info, LssvmParameters p) {
  auto model = LssvmModel::make(std::move(info), std::move(p));
  EXPECT_TRUE(model) << model.error().text();
  return *model;
}

// Var = s_f² (1 − qᵀ A⁻¹ q) with the bordered matrix of eq. 14, computed directly.
TEST(LssvmModel, BiasAndVarianceEqualTheBorderedSystem) {
  const Eigen::Index d = 3, n = 40;
  const LssvmParameters p = random_parameters(d, n);
  const ModelPtr model = made(info_of(d), p);
  Eigen::MatrixXd bordered = Eigen::MatrixXd::Ones(n + 1, n + 1);
  bordered(0, 0) = 0;
  bordered.bottomRightCorner(n, n) = kernel_matrix(p.centres, p.sigma2);
  bordered.diagonal().tail(n).array() += 1 / (p.c * p.weight.array());
  for (const double at : {-1.0, 0.0, 2.0, 30.0}) {
    const Eigen::VectorXd x = Eigen::VectorXd::Constant(d, at);
    const Eigen::VectorXd point = (x - p.normalisation.input_shift).cwiseQuotient(p.normalisation.input_scale);
    Eigen::VectorXd q = Eigen::VectorXd::Ones(n + 1);
    for (Eigen::Index k = 0; k < n; ++k)
      q[k + 1] = std::exp(-(p.centres.col(k) - point).squaredNorm() / (2 * p.sigma2));
    const Prediction found = model->predict({x.data(), static_cast<std::size_t>(d)});
    const double fraction = 1 - q.dot(bordered.partialPivLu().solve(q));
    EXPECT_NEAR(found.bias_deg_per_h, (q.tail(n).dot(p.alpha) + p.b) * 0.02 + 0.01, 1e-15);
    EXPECT_NEAR(found.sd_deg_per_h, std::sqrt(2.5 * fraction) * 1.5 * 0.02, 1e-12);
    EXPECT_EQ(found.extrapolating, fraction > 0.3);
  }
}

// Sd² = factor² (1.25 (v + nuisance²) + offset²) with the error between runs, and its noise² in the mean's; else the
// model's own: the noise of a sample is its prior variance over c.
TEST(LssvmModel, ItsKnowledgeIsThatOfItsFile) {
  ModelInfo info = info_of(2);
  info.domain = {{0, 0}, {4, 2}};
  const LssvmParameters p = random_parameters(2, 30);
  const std::vector<double> x = {5, 1};
  const ModelPtr own = made(info, p);
  const double v = std::pow(own->predict(x).sd_deg_per_h / 1.5, 2);
  const PredictiveUncertainty known = own->predict(x).knowledge.value();
  EXPECT_NEAR(known.model_variance, v, 1e-15);
  EXPECT_EQ(known.target_variance, 0.02 * 0.02);
  EXPECT_EQ(known.skill, 1);
  EXPECT_EQ(known.excess, 0.25);
  EXPECT_NEAR(known.spread.noise_deg_per_h, std::sqrt(2.5 / 20) * 0.02, 1e-15);
  EXPECT_EQ(known.spread, (BetweenRunError{0, 0, known.spread.noise_deg_per_h, 1.5}));
  EXPECT_FALSE(known.preset);
  EXPECT_EQ(known.overlap, 1);
  EXPECT_FALSE(known.edge);
  EXPECT_TRUE(std::isnan(own->predict(x).sd_mean_deg_per_h));
  EXPECT_EQ(own->predict(x).mean_deg_per_h, 0.01);

  info.spread = BetweenRunError{0.003, 0.004, 0.005, 2, 10, 100};
  const Prediction found = made(info, p)->predict(x);
  const double variance = 1.25 * (v + 9e-6) + 16e-6;
  EXPECT_NEAR(found.sd_deg_per_h, 2 * std::sqrt(variance), 1e-12);
  EXPECT_NEAR(found.sd_mean_deg_per_h, 2 * std::sqrt(variance + 25e-6), 1e-12);
  EXPECT_EQ(found.knowledge->spread, *info.spread);
  LssvmParameters svr = p;
  svr.uncertainty.reset(), svr.weight.resize(0);
  info.kind = "svr";
  const Prediction plain = made(info, svr)->predict(x);
  EXPECT_FALSE(plain.knowledge);
  EXPECT_NEAR(plain.sd_deg_per_h, 2 * std::sqrt(1.25 * 9e-6 + 16e-6), 1e-12);
  EXPECT_TRUE(plain.extrapolating);
  EXPECT_FALSE(made(info, svr)->predict(std::vector<double>{4, 2}).extrapolating);
  info.spread.reset();
  EXPECT_TRUE(std::isnan(made(info, svr)->predict(x).sd_deg_per_h));
}

// T, of a range of 4, may leave it by 0.08 and U by 0.2 of its range; a table's inputs by 0.02, models of version 0.1
// by nothing.
TEST(Model, TheMarginOfARangeIsThatOfItsInput) {
  ModelInfo info = info_of(3);
  info.inputs = {"T", "U", "dTdt"};
  EXPECT_EQ(margin_of(info, 1), 0);
  info.spread.emplace();
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(margin_of(info, i), i == 0 ? 0.02 : 0.2) << i;
  info.table = true;
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(margin_of(info, i), 0.02) << i;
}

// A log must not depend on the machine: bias and standard deviation have the same bits at every microarchitecture level
// and in any build. The inputs use no log() or sin() of a library.
TEST(LssvmModel, EveryMachineReturnsTheSamePrediction) {
#if !defined(__x86_64__)
  GTEST_SKIP() << "Eigen fuses multiply and add on this processor, so the last bits differ (x86-64)";
#endif
  std::mt19937_64 random(15);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  LssvmParameters dense = random_parameters(3, 150);
  dense.centres = Eigen::MatrixXd::NullaryExpr(3, 150, uniform);
  dense.alpha = Eigen::VectorXd::NullaryExpr(150, uniform);
  dense.weight = Eigen::VectorXd::NullaryExpr(150, uniform).cwiseAbs().array() + 0.1;
  LssvmParameters sparse = dense;
  const Eigen::MatrixXd features = Eigen::MatrixXd::NullaryExpr(151, 151, uniform);
  sparse.uncertainty->gram = features.lazyProduct(features.transpose());
  sparse.uncertainty->gram.diagonal().array() += 1;
  std::uint64_t hash = 14695981039346656037u;  // FNV-1a
  const auto add = [&](double value) { hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 1099511628211u; };
  for (const LssvmParameters& p : {dense, sparse}) {
    const ModelPtr model = made(info_of(3), p);
    for (int i = 0; i < 200; ++i) {
      const std::vector<double> x = {1 + 3 * uniform(), 1.5 + 4 * uniform(), 2 + 4 * uniform()};
      const Prediction found = model->predict(x);
      add(found.bias_deg_per_h);
      add(found.sd_deg_per_h);
    }
  }
  EXPECT_EQ(hash, 3729465316386388363u);
}

TEST(LssvmModel, OutsideItsBoxThePolicyDecides) {
  ModelInfo info = info_of(2);
  info.domain = {{0, 0}, {2, 3}};
  const ModelPtr model = made(info, random_parameters(2, 30));
  const std::vector<double> far = {1e3, 1e3};
  for (const Extrapolation as_it_is : {Extrapolation::kPreset, Extrapolation::kFlag}) {
    const Prediction flagged = predict_within(*model, far, as_it_is);
    EXPECT_TRUE(flagged.extrapolating);
    EXPECT_NEAR(flagged.bias_deg_per_h, 0.3 * 0.02 + 0.01, 1e-15);
  }
  EXPECT_NEAR(predict_within(*model, far, Extrapolation::kShrink).bias_deg_per_h, 0.01, 1e-6) << "the mean";
  const Prediction edge = model->predict(std::vector<double>{2, 1});
  const Prediction clamped = predict_within(*model, std::vector<double>{7, 1}, Extrapolation::kClamp);
  EXPECT_EQ(clamped.bias_deg_per_h, edge.bias_deg_per_h);
  EXPECT_TRUE(clamped.extrapolating);
  EXPECT_GE(clamped.sd_deg_per_h, edge.sd_deg_per_h);
}

TEST(LssvmModel, ItsFileReadsBackAsTheSameModel) {
  LssvmParameters p = random_parameters(3, 25);
  p.linear = Eigen::VectorXd::LinSpaced(3, -1, 1) / 3;
  const ModelPtr model = made(info_of(3), p);
  const std::string text = format_model(*model);
  const auto read = parse_model(text, "m.json");
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(format_model(**read), text);
  EXPECT_EQ((*read)->info().id, model->info().id);
  const std::vector<double> x = {1, 2, 3};
  EXPECT_EQ((*read)->predict(x).bias_deg_per_h, model->predict(x).bias_deg_per_h);
  EXPECT_EQ((*read)->predict(x).sd_deg_per_h, model->predict(x).sd_deg_per_h);
}

TEST(LssvmModel, RejectsAChangedAlphaAndInconsistentParameters) {
  std::string text = format_model(*made(info_of(1), random_parameters(1, 5)));
  const std::size_t digit = text.find('.', text.find("\"alpha\"")) + 1;
  text[digit] = text[digit] == '7' ? '8' : '7';
  const auto read = parse_model(text, "m.json");
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().text().find("m.json:/id"), std::string::npos) << read.error().text();

  const auto refused = [](Eigen::Index inputs, const LssvmParameters& p) {
    return LssvmModel::make(info_of(inputs), p).error().what;
  };
  LssvmParameters p = random_parameters(1, 4);
  p.centres.setZero();
  p.c = 1e300;
  EXPECT_NE(refused(1, p).find("not positive definite"), std::string::npos) << "repeated centres and a large C";
  p = random_parameters(2, 6);
  p.alpha.conservativeResize(5);
  EXPECT_EQ(refused(2, p), "found 5 alphas, expected 6");
  p = random_parameters(2, 6);
  EXPECT_EQ(refused(3, p), "found 2 inputs for each of 6 centres, expected 3");
  p.weight.resize(0);
  p.uncertainty->gram = Eigen::MatrixXd::Identity(7, 7);
  EXPECT_TRUE(LssvmModel::make(info_of(2), p)) << "sparse";
  p.uncertainty->gram = Eigen::MatrixXd::Identity(7, 6);
  EXPECT_EQ(refused(2, p), "gram has 7 rows, expected 7");
  p.uncertainty.reset();
  EXPECT_TRUE(LssvmModel::make(info_of(2), p)) << "of SVR";
  p = random_parameters(2, 6);
  p.uncertainty->gram = Eigen::MatrixXd::Identity(6, 6);
  EXPECT_EQ(refused(2, p), "gram has 6 rows, expected 7");
  p = random_parameters(2, 6);
  p.centres.resize(2, 0);
  p.alpha.resize(0);
  EXPECT_FALSE(LssvmModel::make(info_of(2), p));
}

// 0 to 100 centres, so that every length of the last chunk occurs; distances from 0 to where exp underflows.
TEST(Kernel, TheSumEqualsASimpleReference) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(-3, 3);
  for (const double sigma2 : {1e-4, 0.01, 1.0, 100.0}) {
    for (Eigen::Index i = 0; i < 106; ++i) {
      constexpr Eigen::Index kLonger[] = {255, 256, 257, 512, 924, 1000};  // than a chunk of the inner loop
      const Eigen::Index n = i < 100 ? i : kLonger[i - 100];
      const Eigen::Index d = 1 + n % 5;
      const Eigen::MatrixXd points = Eigen::MatrixXd::NullaryExpr(d, n, [&] { return uniform(random); });
      const Eigen::VectorXd alpha = Eigen::VectorXd::NullaryExpr(n, [&] { return uniform(random); });
      const Eigen::VectorXd x = Eigen::VectorXd::NullaryExpr(d, [&] { return uniform(random); });
      const KernelCentres centres(points, sigma2);
      long double expected = 0;
      Eigen::VectorXd row(n);
      centres.row(x, row.data());
      for (Eigen::Index k = 0; k < n; ++k) {
        const double value = std::exp(-(points.col(k) - x).squaredNorm() / (2 * sigma2));
        ASSERT_NEAR(row[k], value, kKernelTolerance);
        expected += static_cast<long double>(alpha[k] * value);
      }
      const double found = centres.sum(x, alpha);
      ASSERT_NEAR(found, static_cast<double>(expected), kKernelTolerance * (alpha.cwiseAbs().sum() + 1));
    }
  }
}

TEST(Kernel, TheMatrixContainsTheRowsOfItsPoints) {
  std::mt19937_64 random(13);
  std::normal_distribution<double> normal;
  for (const Eigen::Index n : {1, 31, 32, 33, 100}) {
    const Eigen::MatrixXd points = Eigen::MatrixXd::NullaryExpr(2, n, [&] { return normal(random); });
    const Eigen::MatrixXd k = kernel_matrix(points, 0.3);
    Eigen::VectorXd row(n);
    for (Eigen::Index j = 0; j < n; ++j) {
      KernelCentres(points, 0.3).row(points.col(j), row.data());
      ASSERT_EQ((k.col(j) - row).cwiseAbs().maxCoeff(), 0) << n << ' ' << j;
      ASSERT_EQ(k(j, j), 1);
    }
    ASSERT_EQ((k - k.transpose()).cwiseAbs().maxCoeff(), 0) << n;
  }
}

// alpha ~ 1e5 amplifies the relative error of a single value. The arguments are exact in double, so that the error is
// that of exp alone.
TEST(Kernel, TheErrorOfExpIsBelowTwoUnitsInTheLastPlace) {
  double worst = 0;
  const KernelCentres centres(Eigen::MatrixXd::Zero(1, 1), 0.5);
  for (int i = 0; i <= 20000; ++i) {
    const double distance2 = i * 0.03125;  // exp(0) to exp(−625)
    double value = 0;
    const double point = std::sqrt(distance2);
    centres.row(Eigen::VectorXd::Constant(1, point), &value);
    const long double exact = std::exp(-static_cast<long double>(point * point));
    worst = std::max(worst, static_cast<double>(std::fabs((static_cast<long double>(value) - exact) / exact)));
  }
  EXPECT_LT(worst, 2 * 2.220446049250313e-16);
  double value = 1;
  KernelCentres(Eigen::MatrixXd::Zero(1, 1), 1e-6).row(Eigen::VectorXd::Constant(1, 1e10), &value);
  EXPECT_GE(value, 0);
  EXPECT_LT(value, 1e-300);
}

TEST(CompositeKernel, IsItsFormulaInTheMatrixARowASumAndTheVariance) {
  const CompositeKernel kernel{.rbf = 1.3, .length2 = Eigen::Vector2d(0.7, 2.9), .linear = 0.4, .quadratic = 0.06};
  Eigen::MatrixXd points(2, 4);
  points << -1.1, 0.2, 0.9, 1.7, 0.5, -0.8, 1.4, -0.3;
  Eigen::MatrixXd expected(4, 4);
  for (Eigen::Index i = 0; i < 4; ++i) {
    for (Eigen::Index j = 0; j < 4; ++j) {
      const Eigen::Vector2d x = points.col(i), y = points.col(j);
      const double dot = x.dot(y), d0 = x[0] - y[0], d1 = x[1] - y[1];
      expected(i, j) = 1.3 * std::exp(-d0 * d0 / (2 * 0.7) - d1 * d1 / (2 * 2.9)) + 0.4 * dot + 0.06 * dot * dot;
    }
  }
  EXPECT_LT((kernel.matrix(points) - expected).cwiseAbs().maxCoeff(), 1e-14);
  CompositeCentres centres(kernel, points);
  const Eigen::Vector4d alpha(0.3, -1.2, 0.8, 2.1);
  centres.weigh(alpha);
  for (Eigen::Index i = 0; i < 4; ++i) {
    const Eigen::VectorXd x = points.col(i);
    EXPECT_LT((centres.row(x) - expected.col(i)).cwiseAbs().maxCoeff(), 1e-14);
    EXPECT_NEAR(centres.sum(x), expected.col(i).dot(alpha), 1e-13);
    EXPECT_NEAR(kernel.variance(x), expected(i, i), 1e-14);
  }
}

// A capture has the same log on every machine, because the kernel returns the same bits on any processor, at any
// microarchitecture level, in any build. The number is from GCC 12 for x86-64 and valid for all.
TEST(Kernel, EveryMachineReturnsTheSameBits) {
  std::mt19937_64 random(14);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };  // exact, unlike a library's
  std::uint64_t hash = 14695981039346656037u;                                              // FNV-1a
  const auto add = [&](double value) { hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 1099511628211u; };
  for (const double sigma2 : {0.001, 0.1, 1.0, 30.0}) {
    for (const Eigen::Index n : {1, 7, 16, 100, 300, 924}) {
      const Eigen::MatrixXd points = Eigen::MatrixXd::NullaryExpr(3, n, uniform);
      const Eigen::VectorXd alpha = Eigen::VectorXd::NullaryExpr(n, uniform);
      const Eigen::VectorXd x = Eigen::VectorXd::NullaryExpr(3, uniform);
      const KernelCentres centres(points, sigma2);
      Eigen::VectorXd row(n);
      centres.row(x, row.data());
      for (const double value : row) add(value);
      add(centres.sum(x, alpha));
    }
  }
  EXPECT_EQ(hash, 2914494778659022731u);
}

}  // namespace
}  // namespace prism::compensation
