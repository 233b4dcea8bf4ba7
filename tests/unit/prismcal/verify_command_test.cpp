// SPDX-License-Identifier: MIT
// The command verify: exit codes, text output and JSON.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/file.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/prismcal/commands/commands.hpp"

namespace prism::commands {
namespace {

using testing::HasSubstr;

struct VerifyCommand : testing::Test {
  const test::TemporaryFolder folder;
  const std::string format1 = std::string(PRISM_SOURCE_DIR) + "/tests/recordings/format1";
  const std::string model = std::string(PRISM_SOURCE_DIR) + "/config/models/tao2019-model2.json";
  std::string out, err;

  int run(std::vector<std::string> arguments) {
    CLI::App app("prismcal");
    int code = 0;
    add_verify_command(app, code);
    std::reverse(arguments.begin(), arguments.end());
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    try {
      app.parse(arguments);
    } catch (const CLI::ParseError&) {
      code = 64;
    }
    out = testing::internal::GetCapturedStdout();
    err = testing::internal::GetCapturedStderr();
    return code;
  }
};

TEST_F(VerifyCommand, ReturnsOneIfAFileHasAFault) {
  EXPECT_EQ(run({"verify", model}), 0);
  EXPECT_THAT(out, HasSubstr("faults: 0; intact files: 1"));
  EXPECT_EQ(run({"verify", model, format1}), 1);
  EXPECT_THAT(out, HasSubstr(": torn: "));
  EXPECT_THAT(out, HasSubstr("faults: 1; intact files: 5"));
  EXPECT_EQ(run({"verify"}), 64);
  EXPECT_EQ(run({"verify", model, format1, "--repair", folder.file("clean")}), 64);
}

TEST_F(VerifyCommand, RepairsAndListsRowsLeftOut) {
  EXPECT_EQ(run({"verify", format1, "--repair", folder.file("clean")}), 0);
  EXPECT_THAT(out, HasSubstr(": left out: "));
  EXPECT_EQ(run({"verify", folder.file("clean")}), 0);
  EXPECT_EQ(run({"verify", format1, "--repair", folder.file("clean")}), 1);
  EXPECT_THAT(err, HasSubstr("exists and is not an empty folder"));
}

TEST_F(VerifyCommand, PrintsTheSameAsJson) {
  EXPECT_EQ(run({"verify", format1, "--repair", folder.file("clean"), "--json"}), 0);
  const auto json = nlohmann::json::parse(out);
  EXPECT_EQ(json["faults"], 1);
  EXPECT_EQ(json["findings"].size(), 5u);
  EXPECT_EQ(json["sessions"].size(), 4u);
  EXPECT_EQ(json["repaired"]["rows"], 61);
  EXPECT_EQ(json["repaired"]["left_out"].size(), 1u);
}

}  // namespace
}  // namespace prism::commands
