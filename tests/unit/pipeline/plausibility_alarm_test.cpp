// SPDX-License-Identifier: MIT
// One event when a sensor becomes implausible, one when it recovers, and no others.
#include "daemon/pipeline/plausibility_alarm.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace prism::pipeline {
namespace {

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
