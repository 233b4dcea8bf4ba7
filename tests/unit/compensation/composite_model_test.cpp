// SPDX-License-Identifier: MIT
// The composite model: predictions by matrix inversion and by hand, its file, and what is no model.
#include "compensation/composite_model.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "compensation/extrapolation.hpp"
#include "compensation/model_text.hpp"
#include "tests/support/generated.hpp"
#include "tests/support/models.hpp"

namespace prism::compensation {
namespace {

using Inputs = std::vector<double>;

ModelInfo gyro_info() {
  ModelInfo info;
  info.kind = "composite";
  info.inputs = {"T", "dTdt", "U"};
  info.domain = {{-40, -0.02, 5}, {60, 0.02, 6}};
  info.spread = BetweenRunError{0.01, 0.02, 0.03, 1.5, 10, 400};
  info.provenance_json = "{}";
  return info;
}

CompositeParameters dense_parameters() {
  CompositeParameters p;
  p.variances.kernel = {.rbf = 1.25, .length2 = Eigen::Vector3d(0.75, 2.5, 1.5), .linear = 0.375, .quadratic = 0.0625};
  p.variances.nuisance = 0.5;
  p.variances.nuisance_time_h = 2;
  p.variances.offset = 0.25;
  p.variances.noise = 0.125;
  p.variances.warm_up = 0.5;
  p.beta = 0.25;
  p.centres.resize(3, 5);
  p.centres << -1.5, -0.5, 0.25, 1, 1.75, 0.5, -1, 1.25, 0.75, -0.25, 0.125, 1, -1, 0.5, -1.5;
  p.alpha.resize(5);
  p.alpha << 0.5, -0.75, 0.25, 1, -1;
  p.weight.resize(5);
  p.weight << 1, 0.5, 1, 0.25, 0.75;
  p.time_h.resize(5);
  p.time_h << 0, 0.5, 1.5, 0.25, 0.75;
  p.recording = {0, 0, 0, 1, 1};
  p.normalisation = {Eigen::Vector3d(10, 0.005, 5.5), Eigen::Vector3d(32, 0.01, 0.25), 0.5, 0.0625};
  p.trust = {0.5, 0.03125, 0.25, 0.75, {0.5, 0.125, 0.375}};
  return p;
}

/// [I 0; 0 0] + Ψ Λ⁻¹ Ψᵀ of some Ψ.
CompositeParameters sparse_parameters() {
  CompositeParameters p = dense_parameters();
  p.weight.resize(0), p.time_h.resize(0), p.recording.clear();
  Eigen::MatrixXd psi(6, 6);
  for (Eigen::Index i = 0; i < 6; ++i) {
    for (Eigen::Index j = 0; j < 6; ++j) psi(i, j) = 0.25 * static_cast<double>((3 * i + 5 * j + i * j) % 7);
  }
  p.gram = psi * psi.transpose();
  p.gram.diagonal().array() += 1;
  return p;
}

ModelPtr composite(const CompositeParameters& p, const ModelInfo& info = gyro_info()) {
  auto model = CompositeModel::make(info, p);
  if (!model) throw std::runtime_error(model.error().text());
  return *model;
}

/// The formulas, with loops and an inverse.
struct CompositeReference {
  CompositeParameters p;

  Eigen::VectorXd normal(const Inputs& inputs) const {
    Eigen::VectorXd x(3);
    for (Eigen::Index i = 0; i < 3; ++i)
      x[i] = (inputs[static_cast<std::size_t>(i)] - p.normalisation.input_shift[i]) / p.normalisation.input_scale[i];
    return x;
  }
  double kernel(const Eigen::VectorXd& a, const Eigen::VectorXd& b) const {
    double distance = 0, dot = 0;
    for (Eigen::Index i = 0; i < 3; ++i) {
      distance += (a[i] - b[i]) * (a[i] - b[i]) / (2 * p.variances.kernel.length2[i]);
      dot += a[i] * b[i];
    }
    return 1.25 * std::exp(-distance) + 0.375 * dot + 0.0625 * dot * dot;
  }
  Eigen::VectorXd row(const Inputs& inputs) const {
    Eigen::VectorXd k(5);
    for (Eigen::Index i = 0; i < 5; ++i) k[i] = kernel(p.centres.col(i), normal(inputs));
    return k;
  }
  double bias(const Inputs& inputs) const { return (row(inputs).dot(p.alpha) + 0.25) * 0.0625 + 0.5; }
  double variance(const Inputs& inputs) const {
    const double prior = kernel(normal(inputs), normal(inputs));
    const Eigen::VectorXd k = row(inputs), ones = Eigen::VectorXd::Ones(5);
    Eigen::MatrixXd h(5, 5);
    for (Eigen::Index i = 0; i < 5; ++i) {
      for (Eigen::Index j = 0; j < 5; ++j) {
        h(i, j) = kernel(p.centres.col(i), p.centres.col(j));
        if (p.gram.size() > 0) continue;
        const double apart = std::abs(p.time_h[i] - p.time_h[j]);
        if ((i < 3) == (j < 3)) h(i, j) += 0.5 * std::exp(-apart / 2) + 0.25;
        h(i, j) += 0.5 * std::exp(-p.time_h[i]) * std::exp(-p.time_h[j]);
        if (i == j) h(i, j) += 0.125 / p.weight[i] + 1e-8;
      }
    }
    if (p.gram.size() > 0) {
      h.diagonal().array() += 1e-8 * 1.25;
      Eigen::VectorXd phi = Eigen::VectorXd::Ones(6);
      phi.head(5) = h.llt().matrixL().solve(k);
      return prior - phi.head(5).squaredNorm() + phi.dot(p.gram.inverse() * phi);
    }
    const Eigen::MatrixXd inverse = h.inverse();
    const double level = 1 - ones.dot(inverse * k);
    return prior - k.dot(inverse * k) + level * level / ones.dot(inverse * ones);
  }
};

// T may leave its range of 100 by 2, dTdt its range of 0.04 by 0.008 and U its range of 1 by 0.2.
TEST(CompositeModel, APredictionIsThatOfTheCompleteMatrices) {
  for (const CompositeParameters& p : {dense_parameters(), sparse_parameters()}) {
    const CompositeReference reference{p};
    const ModelPtr model = composite(p);
    struct Case {
      Inputs inputs, edge;
      double excess;
      bool outside;
    };
    for (const Case& c : {Case{{20, 0.005, 5.5}, {}, 0, false},
                          {{61.9, 0.005, 5.5}, {60, 0.005, 5.5}, std::sqrt(0.5) * 0.019, false},
                          {{62.1, 0.005, 5.5}, {60, 0.005, 5.5}, std::sqrt(0.5) * 0.021, true},
                          {{-41.9, 0.0279, 4.81},
                           {-40, 0.0279, 5},
                           std::sqrt(0.5 * 0.019 * 0.019 + 0.125 * 0.1975 * 0.1975 + 0.375 * 0.19 * 0.19),
                           false},
                          {{20, -0.0281, 5.5}, {}, std::sqrt(0.125) * 0.2025, true},
                          {{20, 0, 6.21}, {20, 0, 6}, std::sqrt(0.375) * 0.21, true}}) {
      SCOPED_TRACE(c.inputs[0] + c.inputs[2]);
      const double fraction = reference.variance(c.inputs) - 0.03125, scale2 = 0.0625 * 0.0625;
      ASSERT_GT(fraction, 0);
      const Prediction found = model->predict(c.inputs);
      EXPECT_NEAR(found.bias_deg_per_h, reference.bias(c.inputs), 1e-14);
      EXPECT_EQ(model->bias_deg_per_h(c.inputs), found.bias_deg_per_h);
      EXPECT_EQ(found.extrapolating, c.outside || fraction > 0.25) << fraction;
      EXPECT_EQ(found.mean_deg_per_h, 0.5);
      const double error = 1.25 * (fraction * scale2 + 0.0001) + 0.0004;
      EXPECT_NEAR(found.sd_deg_per_h, 1.5 * std::sqrt(error), 1e-10);
      EXPECT_NEAR(found.sd_mean_deg_per_h, 1.5 * std::sqrt(error + 0.0009), 1e-10);
      const PredictiveUncertainty& known = found.knowledge.value();
      EXPECT_NEAR(known.model_variance, fraction * scale2, 1e-11);
      EXPECT_EQ(known.target_variance, scale2);
      EXPECT_EQ(known.skill, 0.5);
      EXPECT_NEAR(known.excess, c.excess, 1e-12);
      EXPECT_EQ(known.spread, *gyro_info().spread);
      EXPECT_TRUE(known.preset);
      EXPECT_EQ(known.overlap, 0.75);
      const Inputs& edge = c.edge.empty() ? c.inputs : c.edge;
      EXPECT_NEAR(known.edge->bias_deg_per_h, reference.bias(edge), 1e-14);
      EXPECT_NEAR(known.edge->model_variance, (reference.variance(edge) - 0.03125) * scale2, 1e-11);
    }
    EXPECT_EQ(predict_within(*model, Inputs{61, 0, 5.5}, Extrapolation::kPreset).bias_deg_per_h,
              shrunk(model->predict(Inputs{61, 0, 5.5})).bias_deg_per_h);
  }
}

// The least variance is 0: a level above it leaves nothing.
TEST(CompositeModel, TheGuardIsOnTheVarianceAboveTheLevel) {
  CompositeParameters p = dense_parameters();
  const Inputs at = {20, 0.005, 5.5};
  const double fraction = CompositeReference{p}.variance(at) - 0.03125;
  for (const double guard : {0.999 * fraction, 1.001 * fraction}) {
    p.trust.guard = guard;
    EXPECT_EQ(composite(p)->predict(at).extrapolating, guard < fraction);
  }
  p.trust.level = fraction + 1;
  EXPECT_EQ(composite(p)->predict(at).knowledge->model_variance, 0);
  EXPECT_EQ(composite(p)->predict(at).knowledge->edge->model_variance, 0);
  EXPECT_EQ(composite(p)->predict(Inputs{100, 0.005, 5.5}).knowledge->edge->model_variance, 0);
}

ModelPtr gyro_of(double gain, double end) {
  return test::linear_model({"T", "dTdt", "U"}, {gain, 0, 0}, 0.125, {}, {{-50, -1, 4}, {end, 1, 7}});
}

PopulationPrior some_prior() {
  return {1.5, {gyro_of(0.01, 60), gyro_of(0.02, 80), gyro_of(0.06, 100)}, {0.125, 0.225, 0.325}};
}

// At 90 degC: 0.6 + 0.125 − 0.125, 1.6 + 0.125 − 0.225 and 5.4 + 0.125 − 0.325, so 0.6, 1.5 and 5.2, of which the mean
// is 7.3 / 3; the variance is 1.5² · s² (1 + 1/3), s² of N − 1. The nearest points are in the box of each model.
TEST(CompositeModel, APriorIsTheMeanOfOtherGyrosWithItsVariance) {
  const PopulationPrior prior = some_prior();
  const Inputs far = {90, 0, 5.5};
  const auto at = prior.at(far);
  const double mean = 7.3 / 3, s2 = (0.36 + 2.25 + 27.04 - 3 * mean * mean) / 2;
  EXPECT_NEAR(at.mean_deg_per_h, 1.5 * mean, 1e-12);
  EXPECT_NEAR(at.variance, 2.25 * s2 * 4 / 3, 1e-12);
  EXPECT_TRUE(at.extrapolating);
  EXPECT_FALSE(prior.at(Inputs{59, 0, 5.5}).extrapolating);
  EXPECT_TRUE(prior.at(Inputs{61, 0, 5.5}).extrapolating) << "outside the box of one of them";

  CompositeParameters p = dense_parameters();
  const Prediction own = composite(p)->predict(far);
  p.prior = prior;
  const ModelPtr model = composite(p);
  const Prediction found = model->predict(far);
  EXPECT_NEAR(found.bias_deg_per_h, own.bias_deg_per_h + at.mean_deg_per_h, 1e-12);
  EXPECT_EQ(model->bias_deg_per_h(far), found.bias_deg_per_h);
  EXPECT_NEAR(found.mean_deg_per_h, 0.5 + at.mean_deg_per_h, 1e-12);
  EXPECT_NEAR(found.knowledge->target_variance, 0.0625 * 0.0625 + at.variance, 1e-12);
  EXPECT_NEAR(found.knowledge->edge->bias_deg_per_h, own.knowledge->edge->bias_deg_per_h + at.mean_deg_per_h, 1e-12);
  EXPECT_TRUE(found.extrapolating);
  EXPECT_FALSE(model->predict(Inputs{-45, 0, 5.5}).extrapolating) << "in the range of the prior's models";
  EXPECT_TRUE(composite(dense_parameters())->predict(Inputs{-45, 0, 5.5}).extrapolating);
}

// model_errors.txt has the other shapes.
TEST(CompositeModel, ParametersThatDoNotFitAreRefused) {
  const auto refused = [](const auto& change) {
    CompositeParameters p = dense_parameters();
    ModelInfo info = gyro_info();
    change(p, info);
    const auto model = CompositeModel::make(info, p);
    return model ? "" : model.error().text();
  };
  using P = CompositeParameters;
  using I = ModelInfo;
  EXPECT_EQ(refused([](P&, I&) {}), "");
  EXPECT_EQ(refused([](P&, I& i) { i.spread.reset(), i.name = "of 7"; }), "of 7: found no spread, expected one");
  EXPECT_EQ(refused([](P& p, I&) { p.alpha.resize(4); }), "composite: found 4 alphas, expected 5");
  EXPECT_EQ(refused([](P&, I& i) { i.inputs.resize(2); }),
            "composite: found 3 inputs for each of 5 centres, expected 2");
  EXPECT_EQ(refused([](P& p, I&) { p.centres.resize(3, 0), p.alpha.resize(0); }),
            "composite: found 3 inputs for each of 0 centres, expected 3");
  EXPECT_EQ(refused([](P& p, I&) { p.centres.resize(3, 8001), p.alpha.resize(8001); }),
            "composite: found 8001 centres, expected at most 8000: more need gigabytes of memory");
  EXPECT_EQ(refused([](P& p, I&) { p.centres.resize(3, 8000); }), "composite: found 5 alphas, expected 8000");
  EXPECT_EQ(refused([](P& p, I&) { p.time_h.resize(6); }),
            "composite: found 5 weights, 6 times and 5 recordings, expected 5 of each");
  EXPECT_EQ(refused([](P& p, I&) { p.variances.kernel.rbf = -9; }),
            "composite: the covariance of the centres is not positive definite: noise is too small");
  EXPECT_EQ(refused([](P& p, I&) { p.prior = some_prior(); }), "");
  EXPECT_EQ(refused([](P& p, I&) { p.prior = some_prior(), p.prior->levels.pop_back(); }),
            "composite: found 3 models and 2 levels in the prior, expected at least 2 and a level for each");
  EXPECT_EQ(refused([](P& p, I&) { p.prior = some_prior(), p.prior->levels.resize(1), p.prior->models.resize(1); }),
            "composite: found 1 models and 1 levels in the prior, expected at least 2 and a level for each");
  EXPECT_EQ(refused([](P& p, I&) { p.prior = some_prior(), p.prior->levels.resize(2), p.prior->models.resize(2); }),
            "");
  const std::function<void(I&)> others[] = {[](I& i) { i.features.length_s = 10; }, [](I& i) { i.table = true; },
                                            [](I& i) { i.inputs[1] = "case"; }};
  for (const auto& other : others) {
    const std::string text = refused([&](P& p, I& i) { p.prior = some_prior(), other(i); });
    EXPECT_EQ(text, "composite: model " + gyro_of(0.01, 60)->info().id.substr(0, 12) +
                        " of the prior has different inputs or features");
  }
}

// The id is SHA-256 of all of these numbers.
TEST(CompositeModel, ItsIdDependsOnEveryNumber) {
  const std::function<void(CompositeParameters&)> changes[] = {
      [](auto&) {},
      [](auto& p) { p.variances.kernel.rbf = 2; },
      [](auto& p) { p.variances.kernel.linear = 2; },
      [](auto& p) { p.variances.kernel.quadratic = 2; },
      [](auto& p) { p.variances.kernel.length2[1] = 2; },
      [](auto& p) { p.variances.nuisance = 2; },
      [](auto& p) { p.variances.nuisance_time_h = 3; },
      [](auto& p) { p.variances.offset = 2; },
      [](auto& p) { p.variances.noise = 2; },
      [](auto& p) { p.variances.warm_up = 0; },
      [](auto& p) { p.variances.warm_up = 2; },
      [](auto& p) { p.beta = 2; },
      [](auto& p) { p.normalisation.target_shift = 2; },
      [](auto& p) { p.normalisation.target_scale = 2; },
      [](auto& p) { p.normalisation.input_shift[2] = 2; },
      [](auto& p) { p.normalisation.input_scale[2] = 2; },
      [](auto& p) { p.trust.skill = 0.25; },
      [](auto& p) { p.trust.level = 2; },
      [](auto& p) { p.trust.guard = 2; },
      [](auto& p) { p.trust.overlap = 0.5; },
      [](auto& p) { p.trust.relevance[1] = 2; },
      [](auto& p) { p.trust.relevance.clear(); },
      [](auto& p) { p.centres(2, 4) = 2; },
      [](auto& p) { p.alpha[4] = 2; },
      [](auto& p) { p.weight[4] = 2; },
      [](auto& p) { p.time_h[4] = 2; },
      [](auto& p) { p.recording[3] = 0; },
      [](auto& p) { p.prior = some_prior(); },
      [](auto& p) { p.prior = some_prior(), p.prior->scale = 2; },
      [](auto& p) { p.prior = some_prior(), p.prior->levels[1] = 2; },
      [](auto& p) { p.prior = some_prior(), p.prior->models[1] = gyro_of(1, 2); },
      [](auto& p) { p = sparse_parameters(); },
      [](auto& p) { p = sparse_parameters(), p.gram(5, 5) += 1; },
  };
  std::set<std::string> ids;
  for (const auto& change : changes) {
    CompositeParameters p = dense_parameters();
    change(p);
    ids.insert(composite(p)->info().id);
  }
  EXPECT_EQ(ids.size(), std::size(changes));
}

ModelPtr with_prior() {
  CompositeParameters p = dense_parameters();
  p.prior = some_prior();
  return composite(p);
}

// The file is what the writer makes of the numbers above: a sparse model has its matrix instead of the samples.
TEST(CompositeModel, ItsFileIsItsNumbers) {
  test::expect_generated("tests/unit/compensation/composite.json", format_model(*composite(dense_parameters())));
  for (const ModelPtr& model : {composite(dense_parameters()), composite(sparse_parameters()), with_prior()}) {
    const std::string text = format_model(*model);
    const auto read = parse_model(text, "m.json");
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_EQ(format_model(**read), text);
    const Inputs at = {61, -0.01, 5.25};
    EXPECT_EQ((*read)->predict(at).bias_deg_per_h, model->predict(at).bias_deg_per_h);
    EXPECT_EQ((*read)->predict(at).sd_deg_per_h, model->predict(at).sd_deg_per_h);
  }
  const std::string text = format_model(*with_prior());
  const auto damaged = [&](const char* pointer, const nlohmann::json& value) {
    nlohmann::json file = nlohmann::json::parse(text);
    file[nlohmann::json::json_pointer(pointer)] = value;
    return parse_model(file.dump(), "m.json").error().text();
  };
  EXPECT_EQ(damaged("/prior/scale", 0).substr(0, 33), "m.json:/prior/scale: found 0, exp");
  EXPECT_EQ(damaged("/prior/models/1/terms/0/coefficient", "a").substr(0, 60),
            "m.json:/prior/models/1/terms/0/coefficient: found \"a\", expec");
  EXPECT_EQ(damaged("/prior/models/1/kind", "b").substr(0, 48), "m.json:/prior/models/1/kind: found \"b\", expected");
  EXPECT_EQ(damaged("/prior/models", nlohmann::json::array()),
            "m.json: composite: found 0 models and 3 levels in the prior, expected at least 2 and a level for each");
}

// Lines of a file that a person can read.
TEST(CompositeModel, TheLinesOfItsFileAreShort) {
  CompositeParameters p = dense_parameters();
  p.centres = Eigen::MatrixXd::Zero(3, 41);
  p.alpha = p.weight = p.time_h = Eigen::VectorXd::Ones(41);
  p.recording.assign(41, 7);
  const std::string text = format_model(*composite(p));
  std::string widths;
  for (const char* key : {"centres", "alpha", "weight", "time_h", "recording"}) {
    const std::size_t begin = text.find('\n', text.find(std::string("\"") + key + "\": [")) + 1;
    widths += std::to_string(std::count(text.begin() + static_cast<std::ptrdiff_t>(begin),
                                        text.begin() + static_cast<std::ptrdiff_t>(text.find('\n', begin)), ',')) +
              " ";
  }
  EXPECT_EQ(widths, "8 8 8 8 8 ");
}

}  // namespace
}  // namespace prism::compensation
