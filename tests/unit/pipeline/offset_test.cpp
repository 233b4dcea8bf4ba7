// SPDX-License-Identifier: MIT
// An offset by command: its limit, its text and its file.
#include "daemon/pipeline/offset.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <memory>

#include "compensation/polynomial_model.hpp"
#include "tests/support/models.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::pipeline {
namespace {

using testing::HasSubstr;

TEST(Offset, IsLimitedByWhatTheModelStatesOfAnotherRun) {
  compensation::ModelInfo info = test::linear_model({"T"}, {1})->info();
  EXPECT_THAT(check_offset(nullptr, 0.001).error().text(), HasSubstr("found no model"));
  EXPECT_THAT(check_offset(test::linear_model({"T"}, {1}), 0.001).error().text(),
              HasSubstr("does not state how runs differ"));
  info.spread = {.nuisance_deg_per_h = 0.003, .offset_deg_per_h = 0.004, .noise_deg_per_h = 1, .factor = 2};
  const auto model = std::make_shared<compensation::PolynomialModel>(info, std::vector<compensation::Term>{{{1}, 1}});
  for (const double good : {0.0, 0.0299, -0.0299}) EXPECT_TRUE(check_offset(model, good)) << good;
  EXPECT_THAT(check_offset(model, -0.0301).error().text(),
              HasSubstr("found -0.0301 deg/h, expected at most 0.03: 3 times the 0.01 deg/h by which runs differ"));
}

TEST(Offset, IsKeptInAFile) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("gyro.offset.json");
  EXPECT_EQ(load_offset(path).value(), std::nullopt);
  ASSERT_TRUE(store_offset(path, Offset{-0.002, "after the \"move\"", "a0e547", 1'700'000'000, 1'700'028'800}));
  const auto found = load_offset(path);
  ASSERT_TRUE(found && *found);
  EXPECT_EQ(offset_text(**found), "-0.00200 deg/h until 2023-11-15T06:13:20Z: after the \"move\"");
  EXPECT_EQ((*found)->model, "a0e547");
  ASSERT_TRUE(store_offset(path, std::nullopt));
  EXPECT_EQ(load_offset(path).value(), std::nullopt);
  EXPECT_TRUE(store_offset(path, std::nullopt)) << "the file does not exist";
  std::ofstream(path) << R"({"deg_per_h": "much", "reason": "r", "model": "m", "set_s": 1})";
  EXPECT_THAT(load_offset(path).error().text(), HasSubstr("gyro.offset.json:/deg_per_h: found \"much\""));
}

}  // namespace
}  // namespace prism::pipeline
