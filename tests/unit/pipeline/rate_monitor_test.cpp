// SPDX-License-Identifier: MIT
// A description with 10 frames per second, and time stamps of the gyro at 20.
#include "daemon/pipeline/rate_monitor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace prism::pipeline {
namespace {

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

}  // namespace
}  // namespace prism::pipeline
