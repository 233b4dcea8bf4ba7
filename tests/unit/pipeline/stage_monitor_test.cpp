// SPDX-License-Identifier: MIT
// Reported once when it begins and once when it ends: stages without output, wrong rates, implausible sensors.
#include "daemon/pipeline/stage_monitor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "daemon/pipeline/plausibility_alarm.hpp"
#include "daemon/pipeline/rate_monitor.hpp"
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

struct StageMonitorTest : testing::Test {
  void load(bool tagged, const std::string& refused = "") {
    std::ofstream(folder.file("lines.json")) << lines_description(tagged, refused);
    std::ofstream(folder.file("gyro.json")) << R"({"frames": ")" << folder.file("lines.json")
                                            << R"(", "line": {"device": "/dev/null"}, "socket": {"path": ""}})";
    const auto setup = load_setup(folder.file("gyro.json"));
    ASSERT_TRUE(setup) << setup.error().text();
    pipeline.emplace(*setup);
  }
  /// Sends the text each 0.1 s for `seconds`; '#' is the number of the line. Returns the notices.
  std::vector<Notice> run(const std::string& text, int seconds) {
    std::vector<Notice> notices;
    for (int i = 0; i < 10 * seconds; ++i, ++number) {
      std::string line = text;
      if (const auto at = line.find('#'); at != std::string::npos) line.replace(at, 1, std::to_string(100 * number));
      line += "\r\n";
      now_ns += kPeriod_ns;
      pipeline->feed({reinterpret_cast<const std::uint8_t*>(line.data()), line.size()}, now_ns);
      if (i % 10 != 9) continue;
      if (auto notice = monitor.push(*pipeline, now_ns)) notices.push_back(*notice);
    }
    return notices;
  }

  test::TemporaryFolder folder;
  std::optional<Pipeline> pipeline;
  StageMonitor monitor;
  std::int64_t now_ns = kStart_ns;
  int number = 0;
};

TEST_F(StageMonitorTest, ReportsAColumnThatIsNeverANumber) {
  load(false);
  const auto notices = run("# 1,25", 30);
  ASSERT_EQ(notices.size(), 1U);
  EXPECT_TRUE(notices[0].begins);
  EXPECT_NE(notices[0].text.find("frames and no number for axis z, for example \"0 1,25\""), std::string::npos)
      << notices[0].text;
  const auto after = run("# 1.25", 3);
  ASSERT_EQ(after.size(), 1U);
  EXPECT_FALSE(after[0].begins);
  EXPECT_EQ(monitor.problem(), "");
}

TEST_F(StageMonitorTest, ReportsTimeTagsThatAreEqual) {
  load(true);
  EXPECT_TRUE(run("# 1.25", 3).empty());
  const auto notices = run("7 1.25", 30);
  ASSERT_EQ(notices.size(), 1U);
  EXPECT_NE(notices[0].text.find("frames and no rate:"), std::string::npos) << notices[0].text;
  EXPECT_NE(notices[0].text.find("have the counter or time tag of the frame before"), std::string::npos)
      << notices[0].text;
}

TEST_F(StageMonitorTest, ReportsBytesOfAnotherDevice) {
  load(false);
  const auto notices = run("$", 30);
  ASSERT_EQ(notices.size(), 1U);
  EXPECT_NE(notices[0].text.find("bytes and no frame of lines"), std::string::npos) << notices[0].text;
}

TEST_F(StageMonitorTest, ReportsFramesThatTheDescriptionRefuses) {
  load(false, R"(, "after": "0A", "refuse": [{"field": "tag", "mask": 255, "value": 7}])");
  EXPECT_TRUE(run("1 1.25", 3).empty());
  const auto notices = run("7 1.25", 30);
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

int told_of(RateMonitor& watch, int seconds, std::uint32_t samples) {
  int told = 0;
  for (int i = 0; i < seconds; ++i) told += watch.push(samples).has_value();
  return told;
}

TEST(RateMonitor, TellsAWrongRateOnce) {
  RateMonitor watch(10);
  EXPECT_EQ(told_of(watch, 29, 20), 0);
  EXPECT_EQ(watch.push(20),
            "found 20 gyro frames a second by their time stamps, expected 10 (rate_hz): rate_hz is wrong, or frames "
            "are lost all the time");
  EXPECT_EQ(told_of(watch, 100, 20), 0);
}

TEST(RateMonitor, ARateWithinATenthIsTheGyros) {
  RateMonitor watch(200);
  EXPECT_EQ(told_of(watch, 1000, 200), 0);
  EXPECT_EQ(told_of(watch, 1000, 185), 0);
  EXPECT_EQ(told_of(watch, 60, 150), 1);
}

TEST(RateMonitor, LossesNowAndThenAreNoWrongRate) {
  RateMonitor watch(200);
  for (std::uint32_t second = 0; second < 3000; ++second) EXPECT_FALSE(watch.push(second * 7 % 190)) << second;
}

TEST(RateMonitor, OneFrameASecondMoreOrLessIsNothing) {
  RateMonitor slow(4), slower(1);
  EXPECT_EQ(told_of(slow, 100, 5), 0);
  EXPECT_EQ(told_of(slower, 100, 20), 0);
}

TEST(RateMonitor, SecondsBeforeANewSessionDoNotCount) {
  RateMonitor watch(10);
  for (int session = 0; session < 10; ++session) {
    EXPECT_EQ(told_of(watch, 20, 20), 0);
    watch.begin();
  }
}

using compensation::CompensatedWindow;
using compensation::Rejection;

CompensatedWindow watched_row(double degc, bool implausible) {
  CompensatedWindow made;
  made.window.second_mean.rate_deg_per_h = 8;
  made.window.second_mean.temperature_degc = degc;
  made.window.second_mean.implausible.temperature = implausible;
  if (implausible) made.rejections.temperature = {Rejection::Reason::kOutsideLimits, degc, -90, 200};
  return made;
}

std::vector<std::string> told(PlausibilityAlarm& watch, int rows, double degc, bool implausible) {
  std::vector<std::string> texts;
  for (int i = 0; i < rows; ++i) {
    for (const auto& notice : watch.push(watched_row(degc, implausible)))
      texts.push_back((notice.begins ? "in: " : "out: ") + notice.text);
  }
  return texts;
}

TEST(PlausibilityAlarm, TellsOnceInAndOnceOut) {
  PlausibilityAlarm watch;
  EXPECT_THAT(told(watch, 100, 25, false), testing::IsEmpty());
  EXPECT_THAT(told(watch, 100, -273, true),
              testing::ElementsAre("in: temperature is implausible: found -273 degC, expected -90 to 200"));
  EXPECT_THAT(told(watch, 29, 25, false), testing::IsEmpty());
  EXPECT_THAT(told(watch, 100, 25, false),
              testing::ElementsAre("out: temperature is plausible again: 25 degC after 100 implausible seconds"));
  EXPECT_EQ(told(watch, 1, 1000, true).size(), 1u);
}

TEST(PlausibilityAlarm, ASensorThatFlickersIsOneFault) {
  PlausibilityAlarm watch;
  std::size_t notices = 0;
  for (int i = 0; i < 1000; ++i) {
    notices += told(watch, 1, 1000, true).size();
    notices += told(watch, 3, 25, false).size();
  }
  EXPECT_EQ(notices, 1u);
}

TEST(PlausibilityAlarm, EachSensorHasItsOwn) {
  PlausibilityAlarm watch;
  EXPECT_EQ(told(watch, 10, -273, true).size(), 1u);
  CompensatedWindow both = watched_row(-273, true);
  both.window.second_mean.implausible.rate = true;
  both.rejections.rate = {Rejection::Reason::kOutsideLimits, 3.4e38, -3.6e7, 3.6e7};
  const auto notices = watch.push(both);
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_EQ(notices[0].text, "rate is implausible: found 3.4e+38 deg/h, expected -3.6e+07 to 3.6e+07");
}

// A thermometer without data has not recovered.
TEST(PlausibilityAlarm, SilenceIsNoReturn) {
  PlausibilityAlarm watch;
  told(watch, 10, -273, true);
  EXPECT_THAT(told(watch, 100, kUnknown, false), testing::IsEmpty());
}

}  // namespace
}  // namespace prism::pipeline
