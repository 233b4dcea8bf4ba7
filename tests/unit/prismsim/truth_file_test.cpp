// SPDX-License-Identifier: MIT
// The truth file: one row for each full second, marked as simulated.
#include "tools/prismsim/truth_file.hpp"

#include <gtest/gtest.h>

#include "tests/support/shared_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::prismsim {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

simulation::GyroTruth truth_at(double elapsed_s) {
  simulation::GyroTruth truth{elapsed_s, 25, 25.5, 25.25, 0.001, 5.32, 0.0123456, 25.375, {}, 0};
  truth.causes = {0.01, 0.001, 0.0002, -0.0003, 0.0004, 0.0005, 0.0006, -0.0000544, 0.0007};
  truth.case_degc = 26;
  return truth;
}

std::string rows_of(const std::string& text) { return text.substr(text.find("time_utc")); }

TEST(TruthFile, DescribesTheSimulationAndWritesOneRowPerSecond) {
  const test::TemporaryFolder folder;
  simulation::SimulationSettings settings;
  settings.seed = 42;
  {
    auto file = TruthFile::open(folder.file("truth.csv"), settings);
    ASSERT_TRUE(file) << file.error().text();
    for (int i = 1; i <= 5; ++i) ASSERT_TRUE(file->push(1'767'225'600 * kSecond + i * kSecond / 2, truth_at(i * 0.5)));
    ASSERT_TRUE(file->flush());
  }
  const std::string text = test::read_file(folder.file("truth.csv"));
  EXPECT_EQ(text.find("# simulated: "), 0u);
  EXPECT_NE(text.find("\n# profile: paper\n# seed: 42\n"), std::string::npos);
  EXPECT_EQ(
      rows_of(text),
      "time_utc,time_s,elapsed_s,chamber_degc,body_degc,inner_degc,slope_degc_per_s,uhfo_v,bias_deg_per_h,"
      "sensor_degc,thermal_deg_per_h,hysteresis_deg_per_h,turn_on_deg_per_h,warm_up_deg_per_h,flicker_deg_per_h,"
      "mode_hops_deg_per_h,ageing_deg_per_h,tilt_deg_per_h,gradient_deg_per_h,case_degc\n"
      "2026-01-01T00:00:01Z,1767225601,1.000000,25.00000,25.500000,25.250000,0.001000000,5.320000,0.0123456,"
      "25.375000,0.0100000,0.0010000,0.0002000,-0.0003000,0.0004000,0.0005000,0.0006000,-0.0000544,0.0007000,26.00000\n"
      "2026-01-01T00:00:02Z,1767225602,2.000000,25.00000,25.500000,25.250000,0.001000000,5.320000,0.0123456,"
      "25.375000,0.0100000,0.0010000,0.0002000,-0.0003000,0.0004000,0.0005000,0.0006000,-0.0000544,0.0007000,26."
      "00000\n");
}

// A terminal's time begins within a second: the first row is at the first second that ends.
TEST(TruthFile, StartsWithTheFirstFullSecond) {
  const test::TemporaryFolder folder;
  {
    auto file = TruthFile::open(folder.file("truth.csv"), {});
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->push(1'767'225'600 * kSecond + kSecond / 4, truth_at(0.1)));
    ASSERT_TRUE(file->push(1'767'225'601 * kSecond + kSecond / 4, truth_at(1.1)));
  }
  const std::string rows = rows_of(test::read_file(folder.file("truth.csv")));
  EXPECT_EQ(rows.find("2026-01-01T00:00:01Z,1767225601,1.100000,"), rows.find('\n') + 1);
}

TEST(TruthFile, ReportsAFileThatCannotBeWritten) {
  const auto absent = TruthFile::open("/nowhere/truth.csv", {});
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().text(), "/nowhere/truth.csv: cannot be written: No such file or directory");
  const auto device = TruthFile::open("/dev/null", {});
  ASSERT_FALSE(device);
  EXPECT_EQ(device.error().text(), "/dev/null: is a device, expected a regular file");
}

}  // namespace
}  // namespace prism::prismsim
