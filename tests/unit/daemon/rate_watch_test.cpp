// SPDX-License-Identifier: MIT
// A description that says 10 frames a second where the gyro's own time stamps say 20.
#include "daemon/rate_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/daemon/instance_fixture.hpp"

namespace prism::daemon {
namespace {

int told_of(RateWatch& watch, int seconds, std::uint32_t samples) {
  int told = 0;
  for (int i = 0; i < seconds; ++i) told += watch.push(samples).has_value();
  return told;
}

TEST(RateWatch, TellsAWrongRateOnce) {
  RateWatch watch(10);
  EXPECT_EQ(told_of(watch, 29, 20), 0);
  EXPECT_EQ(
      watch.push(20),
      "found 20 gyro frames a second by their time stamps, expected 10 as rate_hz says: a wrong rate_hz, or frames "
      "that are lost all the time");
  EXPECT_EQ(told_of(watch, 100, 20), 0);
}

TEST(RateWatch, ARateWithinATenthIsTheGyros) {
  RateWatch watch(200);
  EXPECT_EQ(told_of(watch, 1000, 200), 0);
  EXPECT_EQ(told_of(watch, 1000, 185), 0);
  EXPECT_EQ(told_of(watch, 60, 150), 1);
}

TEST(RateWatch, LossesNowAndThenAreNoWrongRate) {
  RateWatch watch(200);
  for (std::uint32_t second = 0; second < 3000; ++second) EXPECT_FALSE(watch.push(second * 7 % 190)) << second;
}

TEST(RateWatch, OneFrameASecondMoreOrLessIsNothing) {
  RateWatch slow(4), slower(1);
  EXPECT_EQ(told_of(slow, 100, 5), 0);
  EXPECT_EQ(told_of(slower, 100, 20), 0);
}

TEST(RateWatch, SecondsBeforeANewSessionDoNotCount) {
  RateWatch watch(10);
  for (int session = 0; session < 10; ++session) {
    EXPECT_EQ(told_of(watch, 20, 20), 0);
    watch.begin();
  }
}

class LiveRate : public test::InstanceFixture {};

TEST_F(LiveRate, IsAnEventOfTheInstanceOnce) {
  std::vector<Event> events;
  setup_.clock.source = drivers::ClockSource::kHost;
  Instance instance(setup_, std::vector<std::unique_ptr<RowWriter>>(), nullptr,
                    [&](const Event& event) { events.push_back(event); });
  instance.begin_session(arrival_ns_);
  const double half_s = setup_.frames->period_s() / 2;  // twice as many a second as the description says
  for (int i = 0; i < 80 * 400; ++i) {
    std::vector<std::uint8_t> bytes;
    encoder_.encode({{10.0}, half_s, 25.0, 1.5}, bytes);
    instance.feed(bytes, arrival_ns_ += static_cast<std::int64_t>(half_s * 1e9));
  }
  std::vector<std::string> told;
  for (const Event& event : events) {
    if (event.kind == "rate") told.push_back(event.text);
  }
  EXPECT_THAT(told, testing::ElementsAre(testing::StartsWith(
                        "trplg: found 400 gyro frames a second by their time stamps, expected 200 as rate_hz says")));
}

}  // namespace
}  // namespace prism::daemon
