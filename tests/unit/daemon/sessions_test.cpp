// SPDX-License-Identifier: MIT
// The pipeline's sessions: named by arrival times, as in a replay; seconds never decrease within one.
#include <gtest/gtest.h>

#include <vector>

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

}  // namespace
}  // namespace prism::pipeline
