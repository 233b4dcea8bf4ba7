// SPDX-License-Identifier: MIT
// The table of training methods: its rows are complete, and options and messages list what it contains.
#include "compensation/training/methods.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "compensation/training/summary.hpp"

namespace prism::training {
namespace {

using testing::HasSubstr;

TEST(Methods, HaveCompleteRowsUnderTheirOwnNames) {
  for (const Method* method : methods()) {
    EXPECT_EQ(find_method(method->name), method);
    EXPECT_TRUE(method->plan && method->train && method->describe) << method->name;
    EXPECT_THAT(method_help(), HasSubstr(method->name));
    EXPECT_THAT(parse_method("unknown").error().text(), HasSubstr(method->name));
  }
  EXPECT_EQ(find_method("unknown"), nullptr);
}

TEST(Methods, AreListedByWhatTheyUse) {
  EXPECT_EQ(method_names(kTuning, " and "), "lssvm, ir-lssvm and svr");
  EXPECT_EQ(method_names(kSiblings, " or "), "composite");
}

TEST(Methods, OfPolynomialsReportNoKernelParameters) {
  TrainingData data{{"T"}, Eigen::MatrixXd::Random(1, 50), Eigen::VectorXd::Random(50), {}, {}};
  TrainingSettings settings;
  settings.method = find_method("ls");
  settings.terms = cubic_terms();
  const auto trained = train(data, {}, settings);
  ASSERT_TRUE(trained) << trained.error().text();
  const MethodSummary summary = settings.method->describe(*trained, settings, data.names);
  EXPECT_FALSE(summary.json.contains("c") || summary.json.contains("sigma2"));
  EXPECT_THAT(summary.text, HasSubstr("  residual "));
}

}  // namespace
}  // namespace prism::training
