// SPDX-License-Identifier: MIT
// The first sentence of `prismcal train`, for good, doubtful and useless models.
#include "tools/prismcal/commands/readiness.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "compensation/training/methods.hpp"

namespace prism::commands {
namespace {

using testing::EndsWith, testing::HasSubstr, testing::StartsWith;

/// A bias of 400 samples in two recordings with different means; the errors are half of it.
training::TrainingData two_recordings() {
  training::TrainingData data;
  data.target.resize(400);
  std::mt19937_64 random(5);
  std::normal_distribution<double> bias(0, 0.02);
  for (Eigen::Index i = 0; i < 400; ++i) {
    data.target[i] = bias(random) + (i < 200 ? 1 : 2);
    data.runs.push_back(i < 200 ? 0 : 1);
  }
  return data;
}

training::HeldOutErrors half_of(const training::TrainingData& data) {
  training::HeldOutErrors held;
  held.error.resize(400);
  for (Eigen::Index i = 0; i < 400; ++i) {
    held.error[i] = 0.5 * (data.target[i] - (i < 200 ? 1 : 2));
    held.folds.push_back(static_cast<int>(i / 40));
    held.samples.push_back(i);
  }
  held.model_variance = Eigen::VectorXd::Zero(400);
  return held;
}

TEST(Readiness, ExpectsWhatHeldOutPartsShow) {
  const auto data = two_recordings();
  const auto expected = expectation_of(half_of(data), data);
  ASSERT_TRUE(expected && expected->improvement);
  EXPECT_EQ(expected->parts, 10);
  EXPECT_NEAR(expected->explained, 0.75, 1e-6) << "the means of the recordings do not count";
  EXPECT_NEAR(expected->improvement->value, 0.5, 1e-6);
  EXPECT_LT(expected->improvement->low, 1 - 0.5 * std::exp(0.36)) << "another day differs more than parts of one day";
  EXPECT_GT(expected->improvement->high, 1 - 0.5 * std::exp(-0.36));
  const auto json = expectation_json(expected);
  EXPECT_NEAR(json["improvement_percent"].get<double>(), 50, 1e-4);
  EXPECT_TRUE(expectation_json(std::nullopt).is_null());
}

TEST(Readiness, ExpectsNothingWithoutHeldOutParts) {
  const auto data = two_recordings();
  EXPECT_FALSE(expectation_of({}, data)) << "the recording is too short";
  auto failed = half_of(data);
  failed.error[3] = NAN;
  EXPECT_FALSE(expectation_of(failed, data));
}

TEST(Readiness, SentenceNamesTheNextStepOrTheReason) {
  const auto data = two_recordings();
  auto expected = expectation_of(half_of(data), data);
  training::TrainedModel trained;
  trained.samples.fitted = data.target;
  evaluation::DataQuality quality;
  std::vector<std::string> questions;
  const auto sentence = [&](bool held_out = false) {
    return first_sentence(judge(trained, expected, quality, held_out, questions), expected, quality,
                          "prismcal evaluate m.json ANOTHER-RECORDING --out report");
  };
  EXPECT_THAT(sentence(), StartsWith("ready: explains 75 % of held-out variation, expected improvement 50 % ("));
  EXPECT_THAT(sentence(),
              EndsWith(" %); data quality: pass; next: prismcal evaluate m.json ANOTHER-RECORDING --out report\n"));
  EXPECT_THAT(sentence(true),
              StartsWith("not ready: trained without the held-out part: train again without --hold-out; "));
  quality.verdict = evaluation::Verdict::kWarn;
  quality.findings = {{"length", evaluation::Verdict::kWarn, 150, "blocks", {200, 20}}};
  EXPECT_THAT(sentence(), HasSubstr("; data quality: warn (length 150 blocks, expected at least 200); next: "));
  quality.verdict = evaluation::Verdict::kRefuse;
  EXPECT_THAT(sentence(), StartsWith("not ready: the data quality fails, --force was given: "));
  quality = {};
  questions = {"temperature jumped from 25.0 to 45.0 degC at 7001 s and stayed: a fault, or true?"};
  EXPECT_THAT(sentence(), StartsWith("doubtful: temperature jumped from 25.0 to 45.0 degC at 7001 s and stayed: "));
  questions.clear();
  expected->improvement->low = -0.1;
  EXPECT_THAT(sentence(), StartsWith("doubtful: it may also be no improvement: "));
  expected->explained = -0.05;
  EXPECT_THAT(sentence(), StartsWith("not ready: held-out parts of the recording get worse with it: "));
  EXPECT_THAT(sentence(), Not(HasSubstr("next:")));
  expected.reset();
  EXPECT_THAT(sentence(),
              StartsWith("not ready: 400 samples are too few to test the model on parts of the recording: "));
}

}  // namespace
}  // namespace prism::commands
