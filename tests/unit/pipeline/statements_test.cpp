// SPDX-License-Identifier: MIT
// Statements on a model: the limit, the text and the file of an offset by command, and the verdicts of the monitor.
#include "daemon/pipeline/statements.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "compensation/polynomial_model.hpp"
#include "tests/support/models.hpp"
#include "tests/support/scripts.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::pipeline {
namespace {

using testing::HasSubstr;

Result<void> bound(const compensation::ModelPtr& model, double deg_per_h) {
  Offset offset;
  offset.deg_per_h = deg_per_h;
  return bind_offset(model, offset);
}

TEST(Offset, IsLimitedByWhatTheModelStatesOfAnotherRun) {
  compensation::ModelInfo info = test::linear_model({"T"}, {1})->info();
  EXPECT_THAT(bound(nullptr, 0.001).error().text(), HasSubstr("found no model"));
  EXPECT_THAT(bound(test::linear_model({"T"}, {1}), 0.001).error().text(), HasSubstr("does not state how runs differ"));
  const std::vector<compensation::Term> terms = {{{1}, 1}};
  info.spread = {.nuisance_deg_per_h = 0.003, .offset_deg_per_h = 0.004, .noise_deg_per_h = 1, .factor = 2};
  auto model = std::make_shared<compensation::PolynomialModel>(info, terms);
  for (const double good : {0.0, 0.0299, -0.0299}) EXPECT_TRUE(bound(model, good)) << good;
  EXPECT_THAT(
      bound(model, -0.0301).error().text(),
      HasSubstr("found -0.0301 deg/h, expected at most 0.03: 3 times the 0.01 deg/h by which switch-ons differ"));
  info.monitor = {.offset_deg_per_h = 0.002};
  model = std::make_shared<compensation::PolynomialModel>(info, terms);
  EXPECT_TRUE(bound(model, 0.0059));
  EXPECT_THAT(bound(model, 0.0061).error().text(), HasSubstr("3 times the 0.002 deg/h")) << "the monitor knows better";
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
  const Offset ended{.deg_per_h = 1, .reason = "r", .model = "m"}, later{.deg_per_h = 2, .reason = "r", .model = "m"};
  ASSERT_TRUE(store_offset(path, later));
  forget_offset(path, ended);
  EXPECT_EQ(load_offset(path).value(), later) << "a later one remains";
  forget_offset(path, later);
  EXPECT_EQ(load_offset(path).value(), std::nullopt);
  std::ofstream(path) << R"({"deg_per_h": "much", "reason": "r", "model": "m", "set_s": 1})";
  EXPECT_THAT(load_offset(path).error().text(), HasSubstr("gyro.offset.json:/deg_per_h: found \"much\""));
}

/// "offset JSON" and "verdicts JSON": files, and what is read from them.
class StatementPlayer {
 public:
  std::vector<std::string> play(const std::string& command, std::istream& words) {
    const std::string path = folder_.file("statement.json");
    std::ofstream(path) << test::rest_of(words);
    if (command == "offset") {
      const auto found = load_offset(path);
      if (!found) return {found.error().text().substr(folder_.file("").size())};
      return {fmt::format("{} of {}, set {}", offset_text(**found), (*found)->model, (*found)->set_s)};
    }
    const ModelVerdicts verdicts = read_verdicts(path);
    EXPECT_TRUE(write_verdicts(path, verdicts));
    std::vector<std::string> given;
    for (const auto& [axis, own] : read_verdicts(path))
      given.push_back(fmt::format("{}: {}, {}, model {} at {}", axis, own.verdict, own.text, own.model, own.at_s));
    EXPECT_EQ(given.size(), verdicts.size());
    return given;
  }

 private:
  test::TemporaryFolder folder_;
};

TEST(Statements, Scripts) { test::expect_scripts<StatementPlayer>("pipeline/statements.txt"); }

TEST(Statements, OfTheMonitorAreInTheStateDirectory) {
  config::Config config;
  EXPECT_EQ(monitor_file(config), "");
  config.log.emplace().directory = "/log";
  EXPECT_EQ(monitor_file(config), "/log/monitor.json");
  ::setenv("STATE_DIRECTORY", "", 1);
  EXPECT_EQ(monitor_file(config), "/log/monitor.json");
  ::setenv("STATE_DIRECTORY", "/state", 1);
  EXPECT_EQ(monitor_file(config), "/state/monitor.json");
  ::unsetenv("STATE_DIRECTORY");
}

}  // namespace
}  // namespace prism::pipeline
