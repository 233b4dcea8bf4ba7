// SPDX-License-Identifier: MIT
// A jump that stays, and a value that stops changing, are reported until the data or a reload end them.
#include "daemon/pipeline/sensor_changes.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace prism::pipeline {
namespace {

using compensation::CompensatedWindow;
using compensation::Rejection;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class SensorChangesTest : public testing::Test {
 protected:
  // One row, with the temperature checked as live.
  void row(double degc, double case_degc = 20) {
    CompensatedWindow made;
    auto& mean = made.window.second_mean;
    mean.second = ++second_;
    mean.rate_deg_per_h = 8 + 0.1 * std::sin(static_cast<double>(second_));
    mean.temperature_degc = degc;
    mean.sensor_list = list_;
    mean.sensors = {case_degc};
    if (!check_.check(degc, second_ * 1'000'000'000)) {
      mean.implausible.temperature = mean.all_implausible.temperature = true;
      made.rejections.temperature = check_.rejection();
    }
    for (const Notice& notice : changes_.push(made)) told_.push_back((notice.begins ? "in: " : "out: ") + notice.text);
  }
  void rows(int count, double degc, double case_degc = 20) {
    for (int i = 0; i < count; ++i) row(degc + 0.001 * std::sin(static_cast<double>(second_)), case_degc);
  }

  SensorList list_ = std::make_shared<const std::vector<SensorName>>(std::vector<SensorName>{{"case", "degC"}});
  compensation::SensorCheck check_{compensation::PlausibilityLimits{}.temperature};
  SensorChanges changes_;
  std::int64_t second_ = 1'795'425'060;
  std::vector<std::string> told_;
};

TEST_F(SensorChangesTest, AJumpThatStaysIsOpenUntilItIsEnded) {
  rows(100, 25);
  rows(15, 45);
  EXPECT_THAT(told_, IsEmpty());  // still rejected
  rows(100, 45);
  ASSERT_EQ(told_.size(), 1u);
  EXPECT_THAT(told_[0], testing::MatchesRegex("in: temperature jumped from 2[45][.0-9]* to 4[45][.0-9]* degC at "
                                              "2026-11-23T09:12:41Z and stayed: a fault, or true; .*"));
  EXPECT_EQ(changes_.open().size(), 1u);
  EXPECT_THAT(changes_.end_all(), ElementsAre(HasSubstr("temperature jumped")));
  rows(100, 45);
  EXPECT_THAT(changes_.open(), IsEmpty());
}

TEST_F(SensorChangesTest, AJumpBackEndsItAndNamesTheDoubtfulTime) {
  rows(100, 25);
  rows(100, 45);
  rows(100, 25);
  ASSERT_EQ(told_.size(), 2u);
  EXPECT_THAT(told_[1], HasSubstr("out: temperature jumped back to 2"));
  EXPECT_THAT(told_[1], HasSubstr("its values from 2026-11-23T09:12:41Z to 2026-11-23T09:14:"));
  EXPECT_THAT(changes_.open(), IsEmpty());
}

TEST_F(SensorChangesTest, ASpikeIsNotReported) {
  rows(100, 25);
  rows(10, 45);
  rows(100, 25);
  EXPECT_THAT(told_, IsEmpty());
}

TEST_F(SensorChangesTest, ASecondJumpKeepsTheLastTrustedValue) {
  rows(100, 25);
  rows(100, 45);
  rows(100, 65);
  EXPECT_THAT(changes_.open(), ElementsAre(testing::AllOf(HasSubstr("from 2"), HasSubstr("to 6"))));
}

TEST_F(SensorChangesTest, AnotherThermometerAgrees) {
  rows(100, 25);
  rows(100, 45, 31);
  ASSERT_EQ(told_.size(), 2u);
  EXPECT_THAT(told_[1], HasSubstr("out: the jump of temperature is true: case changed from 20 to 31 degC"));
}

TEST_F(SensorChangesTest, AThermometerAgreesOnlySoon) {
  rows(100, 25);
  rows(SensorChanges::kAgreeS + 10, 45);
  rows(10, 45, 31);
  EXPECT_EQ(changes_.open().size(), 1u);
}

// The axis may use one of the sensors as its thermometer.
TEST_F(SensorChangesTest, ASensorDoesNotAgreeWithItself) {
  for (int i = 0; i < 100; ++i) row(25, 25);
  for (int i = 0; i < 100; ++i) row(45, 45);
  EXPECT_EQ(changes_.open().size(), 1u);
}

TEST_F(SensorChangesTest, AConstantValueOfASensorThatMovedIsOpenUntilItMoves) {
  rows(100, 25, 20);
  for (int i = 0; i < 100; ++i) row(25 + 0.001 * (i % 3), 20);
  for (int i = 0; i < SensorChanges::kStillS; ++i) row(25.5);
  EXPECT_THAT(told_, IsEmpty());
  row(25.5);
  EXPECT_THAT(told_, ElementsAre(HasSubstr("in: temperature is 25.5 degC since 1801 s, and changed at least every ")));
  row(25.6);
  EXPECT_THAT(told_.back(), "out: temperature changes again");
  EXPECT_THAT(changes_.open(), IsEmpty());
  for (int i = 0; i < 2 * SensorChanges::kStillS; ++i) row(25.6);  // it was constant as long before
  EXPECT_EQ(told_.size(), 2u);
}

TEST_F(SensorChangesTest, ASensorThatNeverMovedIsNotReported) {
  rows(3 * SensorChanges::kStillS, 25);
  EXPECT_THAT(changes_.open(), IsEmpty());  // "case" is 20 degC from the start
}

TEST_F(SensorChangesTest, ConstantValuesThatWereEndedDoNotBeginAgain) {
  for (int i = 0; i < 100; ++i) row(25 + 0.001 * (i % 3));
  for (int i = 0; i < SensorChanges::kStillS + 10; ++i) row(25);
  EXPECT_EQ(changes_.end_all().size(), 1u);
  for (int i = 0; i < SensorChanges::kStillS; ++i) row(25);
  EXPECT_THAT(changes_.open(), IsEmpty());
  EXPECT_EQ(told_.size(), 1u);
}

}  // namespace
}  // namespace prism::pipeline
