// SPDX-License-Identifier: MIT
#include "base/time_scale.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

namespace prism {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class TimeScale : public testing::Test {
 protected:
  void TearDown() override { ::unsetenv("PRISM_TIME_SCALE"); }
  static void set(const char* scale) { ::setenv("PRISM_TIME_SCALE", scale, 1); }
};

TEST_F(TimeScale, DividesWaitsIfTheVariableIsSet) {
  EXPECT_TRUE(check_time_scale());
  EXPECT_EQ(scaled(seconds(10)), seconds(10));
  EXPECT_EQ(scaled_s(60), 60);
  set("20");
  EXPECT_TRUE(check_time_scale());
  EXPECT_EQ(scaled(seconds(10)), milliseconds(500));
  EXPECT_EQ(scaled_s(60), 3);
  EXPECT_EQ(scaled_s(5), 1) << "whole seconds, at least one";
  set("2.5");
  EXPECT_EQ(scaled(seconds(10)), seconds(4));
}

TEST_F(TimeScale, AnotherTextIsRefusedAndChangesNoWait) {
  for (const char* wrong : {"", "x", "10x", "0", "0.5", "-2", "101", "nan", "1e9"}) {
    set(wrong);
    const auto checked = check_time_scale();
    ASSERT_FALSE(checked) << wrong;
    EXPECT_EQ(checked.error().text(),
              "PRISM_TIME_SCALE: found \"" + std::string(wrong) + "\", expected a number within 1 to 100");
    EXPECT_EQ(scaled(seconds(10)), seconds(10));
  }
}

}  // namespace
}  // namespace prism
