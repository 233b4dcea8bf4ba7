// SPDX-License-Identifier: MIT
// The command verify: exit codes, text output and JSON.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>

#include "tools/prismcal/commands/commands.hpp"

namespace prism::commands {
namespace {

using testing::HasSubstr;

struct VerifyCommand : testing::Test {
  const std::string format1 = std::string(PRISM_SOURCE_DIR) + "/tests/recordings/format1";
  const std::string whole = format1 + "/gyro1-20261122T041303Z.csv";
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
  EXPECT_EQ(run({"verify", whole}), 0);
  EXPECT_THAT(out, HasSubstr("faults: 0; intact files: 1"));
  EXPECT_EQ(run({"verify", whole, format1}), 1);
  EXPECT_THAT(out, HasSubstr(": torn: "));
  EXPECT_THAT(out, HasSubstr("faults: 1; intact files: 5"));
  EXPECT_EQ(run({"verify"}), 64);
}

TEST_F(VerifyCommand, PrintsTheSameAsJson) {
  EXPECT_EQ(run({"verify", format1, "--json"}), 1);
  const auto json = nlohmann::json::parse(out);
  EXPECT_EQ(json["faults"], 1);
  EXPECT_EQ(json["findings"].size(), 5u);
  EXPECT_EQ(json["sessions"].size(), 4u);
}

}  // namespace
}  // namespace prism::commands
