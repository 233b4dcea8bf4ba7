// SPDX-License-Identifier: MIT
// Reported once when it begins and once when it ends: stages without output.
#include "daemon/pipeline/stream_watch.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace prism::pipeline {
namespace {

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000, kPeriod_ns = 100'000'000;

/// Lines at 10 Hz with a rate in column 1 and, with `tagged`, a time tag of ms in column 0. Lines with `refused` in
/// column 0 have no data.
std::string lines_description(bool tagged, const std::string& refused) {
  return R"({"format": "prism-frames", "version": 1, "name": "lines", "line": {"baud": 9600}, "rate_hz": 10,
    "kinds": [{"name": "data", "length": {"terminator": "0D 0A", "min": 6, "max": 40}, "text": {"separators": " "},
    "fields": {"tag": {"column": 0, "type": ")" +
         std::string(refused.empty() ? "decimal" : "hex") +
         R"("}, "rate": {"column": 1, "type": "decimal", "unit": "deg/h"}})" + refused + R"(}],
    "gyro": {"meaning": "rate", "unit": "deg/h", "axes": {"z": "rate"}})" +
         std::string(tagged ? R"(, "counter": {"field": "tag", "modulus": 1000000, "ticks_per_s": 1000}})" : "}");
}

struct Notice {
  bool begins;
  std::string text;
};

struct StageMonitorTest : testing::Test {
  void load(bool tagged, const std::string& refused = "") {
    std::ofstream(folder.file("lines.json")) << lines_description(tagged, refused);
    std::ofstream(folder.file("gyro.json")) << R"({"frames": ")" << folder.file("lines.json")
                                            << R"(", "line": {"device": "/dev/null"}, "socket": {"path": ""}})";
    const auto setup = load_setup(folder.file("gyro.json"));
    ASSERT_TRUE(setup) << setup.error().text();
    pipeline.emplace(*setup);
  }
  /// Sends the text each 0.1 s for `seconds`; '#' is the number of the line. Returns the notices, also in `notices`.
  std::vector<Notice> run(const std::string& text, int seconds) {
    notices.clear();
    for (int i = 0; i < 10 * seconds; ++i, ++number) {
      std::string line = text;
      if (const auto at = line.find('#'); at != std::string::npos) line.replace(at, 1, std::to_string(100 * number));
      line += "\r\n";
      now_ns += kPeriod_ns;
      pipeline->feed({reinterpret_cast<const std::uint8_t*>(line.data()), line.size()}, now_ns);
      if (i % 10 != 9) continue;
      const std::string problem = monitor.push(*pipeline, now_ns);
      problem.empty() ? problems.clear("no_rate", "over") : problems.set("no_rate", {.text = problem});
    }
    return notices;
  }

  test::TemporaryFolder folder;
  std::optional<Pipeline> pipeline;
  StageMonitor monitor;
  std::vector<Notice> notices;
  Problems problems{[this](bool begins, auto&, const std::string& text) { notices.push_back({begins, text}); }};
  std::int64_t now_ns = kStart_ns;
  int number = 0;
};

TEST_F(StageMonitorTest, ReportsAColumnThatIsNeverANumber) {
  load(false);
  run("# 1,25", 30);
  ASSERT_EQ(notices.size(), 1U);
  EXPECT_TRUE(notices[0].begins);
  EXPECT_NE(notices[0].text.find("frames and no number for axis z, for example \"0 1,25\""), std::string::npos)
      << notices[0].text;
  const auto after = run("# 1.25", 3);
  ASSERT_EQ(after.size(), 1U);
  EXPECT_FALSE(after[0].begins);
  EXPECT_FALSE(problems.has("no_rate"));
}

TEST_F(StageMonitorTest, ReportsTimeTagsThatAreEqual) {
  load(true);
  EXPECT_TRUE(run("# 1.25", 3).empty());
  run("7 1.25", 30);
  ASSERT_EQ(notices.size(), 1U);
  EXPECT_NE(notices[0].text.find("frames and no rate:"), std::string::npos) << notices[0].text;
  EXPECT_NE(notices[0].text.find("have the counter or time tag of the frame before"), std::string::npos)
      << notices[0].text;
}

TEST_F(StageMonitorTest, ReportsBytesOfAnotherDevice) {
  load(false);
  run("$", 30);
  ASSERT_EQ(notices.size(), 1U);
  EXPECT_NE(notices[0].text.find("bytes and no frame of lines"), std::string::npos) << notices[0].text;
}

TEST_F(StageMonitorTest, ReportsFramesThatTheDescriptionRefuses) {
  load(false, R"(, "after": "0A", "refuse": [{"field": "tag", "mask": 255, "value": 7}])");
  EXPECT_TRUE(run("1 1.25", 3).empty());
  run("7 1.25", 30);
  ASSERT_EQ(notices.size(), 1U);
  EXPECT_NE(notices[0].text.find("frames of lines with a fault of the device (its description refuses them)"),
            std::string::npos)
      << notices[0].text;
  EXPECT_EQ(pipeline->decoder().counters().refused, 300U);
}

TEST_F(StageMonitorTest, IsSilentWhileRatesComeAndWithoutData) {
  load(true);
  EXPECT_TRUE(run("# 1.25", 60).empty());
  now_ns += 3'600'000'000'000;
  EXPECT_TRUE(run("# 1.25", 20).empty());
  monitor.begin();
  EXPECT_TRUE(run("# 1.25", 20).empty());
}

}  // namespace
}  // namespace prism::pipeline
