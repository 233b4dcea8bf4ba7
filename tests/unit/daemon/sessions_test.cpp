// SPDX-License-Identifier: MIT
// The pipeline's sessions: named by arrival times, as in a replay; seconds never decrease within one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "daemon/pipeline/device.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "tests/support/daemon_parts.hpp"

namespace prism::pipeline {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

struct PipelineTest : test::DaemonPartsTest {
  PipelineTest() : setup(make_setup()) {
    setup.clock.source = drivers::ClockSource::kHost;
    pipeline = std::make_unique<Pipeline>(setup);
  }
  void take(const Rows& rows) { windows.insert(windows.end(), rows.windows.begin(), rows.windows.end()); }
  void frames(int count) {
    for (int i = 0; i < count; ++i) {
      std::vector<std::uint8_t> bytes;
      encoder_.encode({{10.0}, setup.frames->period_s(), 25.0, 1.5}, bytes);
      now_ns += std::llround(setup.frames->period_s() * 1e9);
      take(pipeline->feed(bytes, now_ns));
    }
  }

  pipeline::Setup setup;
  std::unique_ptr<Pipeline> pipeline;
  std::int64_t now_ns = 1'700'000'000 * kSecond_ns + kSecond_ns / 2;
  std::vector<Rows::Window> windows;
};

TEST_F(PipelineTest, ASessionIsNamedByTheArrivalAtWhichItBegan) {
  frames(250);
  const std::int64_t first = windows.front().session_ns;
  EXPECT_EQ(first, 1'700'000'000 * kSecond_ns + kSecond_ns / 2 + kSecond_ns / 200)
      << "its first bytes, without begin_session()";
  now_ns += kSecond_ns;
  const std::int64_t second = now_ns;
  take(pipeline->begin_session(now_ns));
  EXPECT_EQ(windows.back().session_ns, first) << "the second in progress is of the session that ends";
  EXPECT_TRUE(windows.back().row.window.second_mean.partial);
  frames(300);
  EXPECT_EQ(windows.back().session_ns, second);
  EXPECT_TRUE(windows[windows.size() - 2].row.window.second_mean.partial ||
              windows.back().row.window.second_mean.partial);
}

// A capture of another program has no mark at a step of the host clock.
TEST_F(PipelineTest, AStepBackBeginsASession) {
  frames(600);
  now_ns -= 3600 * kSecond_ns;
  frames(600);
  take(pipeline->finish());
  std::size_t sessions = 1;
  for (std::size_t i = 1; i < windows.size(); ++i) {
    const bool same = windows[i].session_ns == windows[i - 1].session_ns;
    sessions += !same;
    if (same) {
      EXPECT_GT(windows[i].row.window.second_mean.second, windows[i - 1].row.window.second_mean.second);
    }
  }
  EXPECT_EQ(sessions, 2u);
  EXPECT_LT(windows.back().row.window.second_mean.second, windows.front().row.window.second_mean.second);
}

class DeviceTest : public test::DaemonPartsTest {
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

TEST_F(DeviceTest, AWrongRateIsOneEvent) {
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

TEST_F(DeviceTest, AReloadEndsAJumpThatStayed) {
  setup_.clock.source = drivers::ClockSource::kHost;
  std::vector<std::string> told;
  test::DaemonParts parts(setup_, {}, [&](const socket::Event& event) {
    if (event.kind == "question") told.push_back(event.text);
  });
  parts.begin_session(arrival_ns_);
  const double period_s = setup_.frames->period_s();
  feed(parts, 100 * 200, period_s, 25);
  feed(parts, 60 * 200, period_s, 45);
  EXPECT_EQ(parts.problems.list().size(), 1u);
  ASSERT_TRUE(parts.device.reconfigure(setup_));
  EXPECT_TRUE(parts.problems.list().empty());
  EXPECT_THAT(told, testing::ElementsAre(testing::StartsWith("temperature jumped from 25 to 45 degC"),
                                         testing::StartsWith("ended by the reload: temperature jumped")));
}

}  // namespace
}  // namespace prism::pipeline
