// SPDX-License-Identifier: MIT
// Described and arrival times of frames: when they differ, and what must not be taken for a difference.
#include "drivers/frame_rate_check.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace prism::drivers {
namespace {

constexpr double kEpochS = 1.8e9;

struct Frames {
  FrameRateCheck check{};
  double y = kEpochS;

  /// Frames for `seconds` of arrivals, `rate_hz` of them a second, described as 200 a second.
  void arrive(double seconds, double rate_hz) {
    for (double end = y + seconds; y < end;) check.push(0.005, y += 1 / rate_hz);
  }
};

struct FrameRateCheckTest : testing::Test {
  Frames frames;
};

TEST_F(FrameRateCheckTest, FindsALargeDifferenceAfterTenSeconds) {
  frames.arrive(9.5, 10);
  EXPECT_FALSE(frames.check.differs());
  frames.arrive(2, 10);
  EXPECT_TRUE(frames.check.differs());
  EXPECT_NEAR(200 * frames.check.ratio(), 10, 0.01);
}

TEST_F(FrameRateCheckTest, FindsOneAndAHalfPercentInAHundredSeconds) {
  for (const double rate_hz : {197.0, 203.0}) {
    frames = {};
    frames.arrive(103, rate_hz);
    EXPECT_TRUE(frames.check.differs()) << rate_hz;
    EXPECT_NEAR(200 * frames.check.ratio(), rate_hz, 0.05);
  }
}

TEST_F(FrameRateCheckTest, AcceptsHalfAPercent) {
  frames.arrive(1000, 201);
  EXPECT_FALSE(frames.check.differs());
  EXPECT_NEAR(frames.check.ratio(), 1.005, 1e-4);
}

TEST_F(FrameRateCheckTest, AcceptsTheToleranceOfTheGyro) {
  frames = {FrameRateCheck(0.03)};
  frames.arrive(300, 205);
  EXPECT_FALSE(frames.check.differs());
  frames.arrive(300, 207);
  EXPECT_TRUE(frames.check.differs());
}

TEST_F(FrameRateCheckTest, ADifferenceEndsAfterAHundredSecondsThatAgree) {
  frames.arrive(120, 400);
  EXPECT_TRUE(frames.check.differs());
  frames.arrive(220, 200);
  EXPECT_FALSE(frames.check.differs());
}

TEST_F(FrameRateCheckTest, APauseWithLostFramesIsNoDifference) {
  frames.arrive(50, 200);
  frames.y += 30;
  frames.arrive(400, 200);
  EXPECT_FALSE(frames.check.differs());
}

TEST_F(FrameRateCheckTest, FramesThatWaitedAndArriveTogetherAreNoDifference) {
  for (int second = 0; second < 300; second += 3) {
    frames.y += 3;
    for (int i = 0; i < 600; ++i) frames.check.push(0.005, frames.y);
    EXPECT_FALSE(frames.check.differs()) << second;
  }
}

TEST_F(FrameRateCheckTest, ACounterOrClockThatWasSetIsNoDifference) {
  frames.arrive(50, 200);
  frames.check.push(7200, frames.y += 0.005);
  frames.arrive(150, 200);
  frames.y -= 3600;
  frames.arrive(150, 200);
  frames.y += 3600;
  frames.arrive(150, 200);
  EXPECT_FALSE(frames.check.differs());
}

TEST_F(FrameRateCheckTest, ASessionKeepsTheResultUntilThereIsAnother) {
  frames.arrive(50, 10);
  frames.check.begin();
  frames.arrive(50, 200);
  EXPECT_TRUE(frames.check.differs());
  frames.arrive(60, 200);
  EXPECT_FALSE(frames.check.differs());
}

}  // namespace
}  // namespace prism::drivers
