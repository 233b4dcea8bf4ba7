// SPDX-License-Identifier: MIT
#include "base/alarm.hpp"

#include <gtest/gtest.h>

namespace prism {
namespace {

TEST(Alarm, AProblemIsReportedWhenItBeginsChangesAndEnds) {
  Alarm alarm;
  EXPECT_FALSE(alarm.set(""));
  EXPECT_TRUE(alarm.set("no space"));
  EXPECT_FALSE(alarm.set("no space"));
  EXPECT_TRUE(alarm.set("read-only"));
  EXPECT_TRUE(alarm.is_active());
  EXPECT_TRUE(alarm.set(""));
  EXPECT_FALSE(alarm.is_active());
}

TEST(Alarm, AStateIsReportedOnlyWhenItBeginsAndEnds) {
  Alarm alarm;
  EXPECT_TRUE(alarm.set_state("no answer for 5 s"));
  EXPECT_FALSE(alarm.set_state("no answer for 6 s"));
  EXPECT_EQ(alarm.problem(), "no answer for 6 s");
  EXPECT_TRUE(alarm.set_state(""));
  EXPECT_FALSE(alarm.set_state(""));
}

}  // namespace
}  // namespace prism
