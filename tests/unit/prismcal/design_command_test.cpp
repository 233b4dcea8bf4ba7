// SPDX-License-Identifier: MIT
// `prismcal design` without a model: set-points within the chamber's limits, the worth of recordings, errors in one
// line.
#include <gtest/gtest.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

#include "base/file.hpp"
#include "compensation/model_text.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/prismcal/simulated_day.hpp"
#include "tools/prismcal/commands/commands.hpp"

namespace prism::prismcal {
namespace {

class DesignCommand : public testing::Test {
 protected:
  int run(std::vector<std::string> arguments) {
    CLI::App app("prismcal");
    int code = 0;
    commands::add_design_command(app, code);
    arguments.insert(arguments.begin(), "design");
    arguments.insert(arguments.end(), {"--out", out_file_});
    std::reverse(arguments.begin(), arguments.end());
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    try {
      app.parse(arguments);
    } catch (const CLI::ParseError& error) {
      code = 64;
    }
    out_ = testing::internal::GetCapturedStdout();
    err_ = testing::internal::GetCapturedStderr();
    return code;
  }

  std::vector<std::string> stated(std::vector<std::string> more) const {
    std::vector<std::string> all = {"--bias-sd", "0.02",     "--noise",
                                    "0.0064",    "--domain", "T=-30:60, dTdt=-0.5:0.5 degC/min"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  const test::TemporaryFolder folder_;
  const std::string out_file_ = folder_.file("cycle.csv");
  std::string out_, err_;
};

TEST_F(DesignCommand, WritesSetPointsWithinTheLimits) {
  ASSERT_EQ(run(stated({"--chamber", "rate<=2 degC/min, T=-35:55", "--hours", "4", "--quiet"})), 0) << err_;
  const auto text = read_text_file(out_file_);
  ASSERT_TRUE(text);
  std::istringstream lines(*text);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "time_s,temperature_degc");
  double before_s = 0, before_degc = 25;
  while (std::getline(lines, line)) {
    double time_s = 0, degc = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf", &time_s, &degc), 2) << line;
    EXPECT_GE(degc, -35);
    EXPECT_LE(degc, 55);
    EXPECT_LE(std::abs(degc - before_degc), 2.0 / 60 * (time_s - before_s) + 0.1) << line;
    before_s = time_s;
    before_degc = degc;
  }
  EXPECT_NEAR(before_s, 4 * 3600, 60);
  EXPECT_EQ(out_.find("\\x"), std::string::npos) << out_;
  for (const char* expected : {"first: designed", "first: the paper's cycle", "first: slow ramp", "first: staircase",
                               "none: spread of the bias", "--thermal-lag, --self-heating"})
    EXPECT_NE(out_.find(expected), std::string::npos) << expected << "\n" << out_;
  EXPECT_EQ(err_, "");
}

TEST_F(DesignCommand, PrintsTheSameAsJson) {
  ASSERT_EQ(run(stated({"--hours", "3", "--json", "--quiet"})), 0) << err_;
  const auto json = nlohmann::json::parse(out_);
  const auto& rows = json["tables"]["worth"]["rows"];
  ASSERT_EQ(rows.size(), 6U);
  EXPECT_EQ(rows[0][2]["value"], 0.02);
  const double designed = rows[1][2]["value"];
  for (std::size_t i = 3; i < 6; ++i) EXPECT_LT(designed, rows[i][2]["value"].get<double>()) << i;
  EXPECT_TRUE(json["figures"].contains("profile_figure"));
  for (const char* kind : {"tables", "figures"}) {
    for (const auto& [name, part] : json[kind].items()) {
      const std::string meaning = part.value("meaning", "");
      EXPECT_EQ(meaning.empty() ? ' ' : meaning.back(), '.') << name;
    }
  }
  const double best = rows[2][2]["value"], before = rows[0][2]["value"];
  char expected[100];
  std::snprintf(expected, sizeof expected, "The designed profile takes %.0f %% of the sd away; the best other, ",
                100 * (1 - designed / before));
  EXPECT_EQ(json["tables"]["worth"]["meaning"].get<std::string>().substr(0, std::strlen(expected)), expected);
  EXPECT_LT(best, before);
}

TEST_F(DesignCommand, NamesWhatIsMissing) {
  EXPECT_EQ(run({"--domain", "T=-30:60"}), 1);
  EXPECT_EQ(err_, "prismcal: design: found no model and no --prior; expected one of them, or --bias-sd and --noise\n");
  EXPECT_EQ(run({"--bias-sd", "0.02", "--noise", "0.006"}), 1);
  EXPECT_EQ(err_, "prismcal: design: expected --domain or --mission, one of them\n");
  EXPECT_EQ(run(stated({"--chamber", "T=30:40"})), 1);
  EXPECT_EQ(err_, "prismcal: --start: found 25 degC, expected 30 to 40, the limits of the chamber\n");
  EXPECT_EQ(run(stated({"--hours", "0.5", "--chamber", "rate<=0.1 degC/min"})), 1);
  EXPECT_EQ(err_.substr(0, 45), "prismcal: --hours: found 0.5 h, too short for");
  EXPECT_EQ(run({"--bias-sd", "0.02", "--noise", "0.006", "--domain", "T=-40:600"}), 1);
  EXPECT_EQ(err_, "prismcal: --domain: T: found -40:600, expected limits within -200 to 300 degC\n");
  EXPECT_EQ(run({"--bias-sd", "0.02", "--noise", "0.006", "--domain", "T=233:333 K"}), 1);
  EXPECT_EQ(err_, "prismcal: --domain: T: found unit \"K\", expected degC\n");
  const std::string model = folder_.file("line.json");
  ASSERT_TRUE(write_text_file(model, compensation::format_model(*test::linear_model(1e-4))));
  EXPECT_EQ(run({model, "--domain", "T=-30:60"}), 1);
  EXPECT_EQ(err_, "prismcal: line: found a model of type polynomial, expected composite, made by prismcal train\n");
  EXPECT_EQ(run({"--mission", folder_.file("log"), model}), 1);
  EXPECT_EQ(err_, "prismcal: --mission: " + model +
                      " is a model, expected recordings; put the model first: prismcal design " + model +
                      " --mission RECORDING\n");
}

}  // namespace
}  // namespace prism::prismcal
