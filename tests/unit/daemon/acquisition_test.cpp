// SPDX-License-Identifier: MIT
// Events of the acquisition.
#include "daemon/pipeline/acquisition.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/daemon_parts.hpp"

namespace prism::daemon {
namespace {

class AcquisitionTest : public test::DaemonPartsTest {
 protected:
  /// Feeds frames of 10 deg/h that arrive every `step_s`.
  void feed(test::DaemonParts& parts, int frames, double step_s, double temperature_degc) {
    for (int i = 0; i < frames; ++i) {
      std::vector<std::uint8_t> bytes;
      encoder_.encode({{10.0}, step_s, temperature_degc, 1.5}, bytes);
      parts.feed(bytes, arrival_ns_ += static_cast<std::int64_t>(step_s * 1e9));
    }
  }
};

TEST_F(AcquisitionTest, AWrongRateIsOneEvent) {
  setup_.clock.source = drivers::ClockSource::kHost;
  std::vector<std::string> told;
  test::DaemonParts parts(setup_, {}, [&](const socket::Event& event) {
    if (event.kind == "rate") told.push_back(event.text);
  });
  parts.begin_session(arrival_ns_);
  const double half_s = setup_.frames->period_s() / 2;  // twice as many a second as the description says
  feed(parts, 80 * 400, half_s, 25);
  EXPECT_THAT(told, testing::ElementsAre("frames arrive at 400.00 a second, the description says 200 (rate_hz)"));
}

TEST_F(AcquisitionTest, AReloadEndsAJumpThatStayed) {
  setup_.clock.source = drivers::ClockSource::kHost;
  std::vector<std::string> told;
  test::DaemonParts parts(setup_, {}, [&](const socket::Event& event) {
    if (event.kind == "question") told.push_back(event.text);
  });
  parts.begin_session(arrival_ns_);
  const double period_s = setup_.frames->period_s();
  feed(parts, 100 * 200, period_s, 25);
  feed(parts, 60 * 200, period_s, 45);
  EXPECT_EQ(parts.acquisition.record(0).changes().size(), 1u);
  ASSERT_TRUE(parts.acquisition.reconfigure(setup_));
  EXPECT_TRUE(parts.acquisition.record(0).changes().empty());
  EXPECT_THAT(told, testing::ElementsAre(testing::StartsWith("temperature jumped from 25 to 45 degC"),
                                         testing::StartsWith("ended by the reload: temperature jumped")));
}

}  // namespace
}  // namespace prism::daemon
