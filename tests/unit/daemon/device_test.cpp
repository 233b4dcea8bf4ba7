// SPDX-License-Identifier: MIT
// A device: its logs' limits, disagreeing clocks, jumps and reloads, and the verdicts on its model.
#include "daemon/pipeline/device.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "daemon/log/row_log.hpp"
#include "tests/support/daemon_parts.hpp"
#include "tests/support/models.hpp"

namespace prism::pipeline {
namespace {

using testing::ElementsAre, testing::StartsWith;

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
  /// Collects the events of a kind.
  test::DaemonParts::Told teller(const std::string& kind) {
    return [this, kind](const socket::Event& event) {
      if (event.kind == kind) told_.push_back(event.text);
    };
  }

  std::vector<std::string> told_;
};

TEST(OutputStatus, LatencyIsAQuantileOfTheLatestWrites) {
  OutputStatus status;
  EXPECT_TRUE(std::isnan(status.latency_s(0.5)));
  for (const float s : {3e-3f, 1e-3f, 2e-3f}) status.latencies_s.push_back(s);
  EXPECT_NEAR(status.latency_s(0), 1e-3, 1e-9);
  EXPECT_NEAR(status.latency_s(0.5), 2e-3, 1e-9);
  EXPECT_NEAR(status.latency_s(1), 3e-3, 1e-9);
}

TEST_F(DeviceTest, AWrongRateIsOneEvent) {
  setup_.clock.source = drivers::ClockSource::kHost;
  test::DaemonParts parts(setup_, {}, teller("rate"));
  parts.begin_session(arrival_ns_);
  const double half_s = setup_.frames->period_s() / 2;  // twice as many a second as the description says
  feed(parts, 80 * 400, half_s, 25);
  const std::string wrong = "frames arrive at 400.00 a second, the description says 200 (rate_hz)";
  EXPECT_THAT(told_, ElementsAre(wrong));
  EXPECT_EQ(parts.device.clocks_differed, wrong);
  feed(parts, 200 * 200, 2 * half_s, 25);
  EXPECT_THAT(told_, ElementsAre(wrong, "frames arrive as described again"));
  EXPECT_EQ(parts.device.clocks_differed, wrong) << "a replay ends with it";
}

TEST_F(DeviceTest, AReloadEndsAJumpThatStayed) {
  setup_.clock.source = drivers::ClockSource::kHost;
  test::DaemonParts parts(setup_, {}, teller("question"));
  parts.begin_session(arrival_ns_);
  const double period_s = setup_.frames->period_s();
  feed(parts, 100 * 200, period_s, 25);
  feed(parts, 60 * 200, period_s, 45);
  EXPECT_EQ(parts.problems.list().size(), 1u);
  ASSERT_TRUE(parts.device.reconfigure(setup_));
  EXPECT_TRUE(parts.problems.list().empty());
  EXPECT_THAT(told_, ElementsAre(StartsWith("temperature jumped from 25 to 45 degC"),
                                 StartsWith("ended by the reload: temperature jumped")));
}

TEST_F(DeviceTest, AVerdictIsOnTheModelInUse) {
  setup_.axes[0].model = test::linear_model({"T"}, {1});
  const std::string id = setup_.axes[0].model->info().id;
  test::DaemonParts parts(setup_, {}, teller("monitor"));
  const auto take = [&](const std::string& axis, const std::string& model, const std::string& verdict) {
    parts.device.take_verdicts({{axis, {verdict, "it " + verdict, model, 1}}});
    return parts.device.axes[0].verdict.has_value();
  };
  EXPECT_TRUE(take(kOnlyAxis, id, "holds"));
  EXPECT_TRUE(take(kOnlyAxis, id, "drifted"));
  EXPECT_TRUE(parts.problems.has("monitor"));
  EXPECT_FALSE(take(kOnlyAxis, "another", "drifted"));
  EXPECT_FALSE(take("z", id, "drifted")) << "of a configuration with axes";
  EXPECT_TRUE(take(kOnlyAxis, id, "drifted"));
  EXPECT_TRUE(take(kOnlyAxis, id, "holds"));
  parts.device.take_verdicts({});
  EXPECT_FALSE(parts.device.axes[0].verdict);
  EXPECT_THAT(told_, ElementsAre("model: it drifted", "model: no verdict", "model: it drifted", "model: it holds"));
  setup_.axes[0].model = nullptr;
  test::DaemonParts without(setup_);
  without.device.take_verdicts({{kOnlyAxis, {"drifted", "", "", 1}}});
  EXPECT_FALSE(without.device.axes[0].verdict);
}

TEST_F(DeviceTest, TheLogsOfItsAxesShareTheLimit) {
  const auto limit = [this](std::int64_t keep_bytes) {
    setup_.config.log->keep_bytes = keep_bytes;
    return log_settings(setup_).keep_bytes;
  };
  setup_ = make_setup(R"(, "axes": {"x": {}, "y": {}})", "stim300");
  setup_.config.log.emplace();
  EXPECT_EQ(limit(1001), 500);
  EXPECT_EQ(limit(config::kNoByteLimit), config::kNoByteLimit);
  EXPECT_EQ(limit(config::kNoByteLimit - 1), (config::kNoByteLimit - 1) / 2);
  EXPECT_EQ(log_name(setup_, 0), "gyro-x");
  EXPECT_EQ(log_name(setup_, 1), "gyro-y");
  setup_.config.log.reset();
  EXPECT_TRUE(log::make_logs(setup_, nullptr, parts_->problems, {}, {}).empty());
}

}  // namespace
}  // namespace prism::pipeline
