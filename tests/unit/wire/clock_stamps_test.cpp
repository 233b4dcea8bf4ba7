// SPDX-License-Identifier: MIT
// Accurate stamps: the clock removes jitter, estimates the true period, and recovers from stalls and wrong clocks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/unit/wire/clock_line.hpp"

namespace prism::wire {
namespace {

using test::kEpochNs;
using test::kRateDegPerH;
using test::Line;
using test::loose_thousand_hz;
using test::reading_of;
using test::run;
using test::seconds;
using test::wire_s;

/// rms and worst error of the stamps in the second half, s.
std::pair<double, double> stamp_error(const std::vector<Sample>& samples, double true_rate_hz) {
  double squares = 0;
  double worst = 0;
  const std::size_t half = samples.size() / 2;
  for (std::size_t i = half; i < samples.size(); ++i) {
    const double error = std::abs(seconds(samples[i].time_ns) - static_cast<double>(i + 1) / true_rate_hz);
    squares += error * error;
    worst = std::max(worst, error);
  }
  return {std::sqrt(squares / static_cast<double>(samples.size() - half)), worst};
}

// A USB adapter that delivers the bytes of 16 ms at once.
double batched(double t) { return std::ceil(t / 0.016) * 0.016 - t; }

TEST(Clock, RemovesTheJitterOfAUart) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description);
  std::mt19937 random(3);
  std::exponential_distribution<double> delay(1 / 0.3e-3);
  Line line;
  line.true_rate_hz = 200.01;
  line.delay_s = [&](int i) { return i % 1000 == 77 ? 0.006 : delay(random); };
  const auto samples = run(clock, description, line, 240 * 200);
  const auto [rms, worst] = stamp_error(samples, line.true_rate_hz);
  EXPECT_LT(rms, 5e-6);
  EXPECT_LT(worst, 20e-6);
  EXPECT_NEAR(clock.status().period_s, 1 / 200.01, 1e-6 * 0.005);
  EXPECT_EQ(clock.status().resets, 0u);
}

TEST(Clock, RemovesTheJitterOfAUsbAdapter) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description);
  Line line;
  line.true_rate_hz = 200.013;
  line.delay_s = [&](int i) { return batched(i / 200.013 + 0.0003); };
  const auto samples = run(clock, description, line, 240 * 200);
  const auto [rms, worst] = stamp_error(samples, line.true_rate_hz);
  EXPECT_LT(rms, 400e-6);
  EXPECT_LT(worst, 800e-6);
  EXPECT_EQ(clock.status().resets, 0u);
}

TEST(Clock, ComputesRightRatesAt962HzInsteadOf1000) {
  const auto description = loose_thousand_hz();
  drivers::Clock clock(description);
  std::mt19937 random(3);
  std::exponential_distribution<double> delay(1 / 0.3e-3);
  Line line;
  line.true_rate_hz = 962.4;
  line.delay_s = [&](int) { return delay(random); };
  const auto samples = run(clock, description, line, 60'000);
  double angle = 0;
  double time_s = 0;
  std::int64_t last = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_GE(samples[i].time_ns, last) << "stamps never decrease";
    last = samples[i].time_ns;
    if (i < 10'000) continue;
    angle += samples[i].rate_deg_per_h * samples[i].interval_s;
    time_s += samples[i].interval_s;
  }
  EXPECT_NEAR(angle / time_s / kRateDegPerH, 1, 1e-4);
  EXPECT_NEAR(clock.status().period_s * 962.4, 1, 1e-5);
  EXPECT_TRUE(clock.status().period_is_estimated);
}

TEST(Clock, KeepsThePeriodDuringAStall) {
  const auto description = loose_thousand_hz();
  drivers::Clock clock(description);
  Line line;
  line.true_rate_hz = 962.4;
  line.delay_s = [](int i) { return i >= 2000 && i < 2400 ? (2400 - i) / 962.4 : 0.0; };
  run(clock, description, line, 10'000);
  EXPECT_NEAR(clock.status().period_s * 962.4, 1, 1e-5);
  EXPECT_EQ(clock.status().resets, 0u);
}

TEST(Clock, ForgetsAnOldPeriod) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description, {.switch_s = 20});
  // The device's clock gets faster by 1e-4 after a minute: 5 us less a frame.
  double measured_s = 0;
  std::optional<Sample> last;
  for (int i = 0; i < 40'000; ++i) {
    measured_s += i < 12'000 ? 1.0 / 200 : 1.0 / 200.02;
    DecodedMessage reading = reading_of(description, {}, i);
    reading.arrival_ns = kEpochNs + std::llround(1e9 * (measured_s + wire_s(*description)));
    last = test::pushed(clock, reading);
  }
  ASSERT_TRUE(last);
  EXPECT_NEAR(clock.status().period_s * 200.02, 1, 1e-9);
  EXPECT_NEAR(seconds(last->time_ns), measured_s, 2e-6);
}

TEST(Clock, RecoversFromAWrongFirstStamp) {
  const auto description = test::shipped("trplg");
  for (const double wrong_s : {86'400.0, 0.3, -86'400.0, -0.3}) {
    drivers::Clock clock(description);
    Line line;
    line.delay_s = [&](int i) { return i == 0 ? wrong_s : 0.0; };
    const auto samples = run(clock, description, line, 1000);
    EXPECT_NEAR(seconds(samples.back().time_ns), 999.0 / 200, 1e-5) << "first stamp wrong by " << wrong_s << " s";
    for (std::size_t i = 1; i < samples.size() && wrong_s < 1; ++i)
      ASSERT_GE(samples[i].time_ns, samples[i - 1].time_ns);
    EXPECT_EQ(clock.status().resets, 1u);
  }
}

TEST(Clock, NeverReturnsAnEarlierStamp) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description);
  Line line;
  line.delay_s = [](int i) { return i < 40 ? 0.3 : 0.0; };  // a backlog, read at once when the line was opened
  const auto samples = run(clock, description, line, 1000);
  for (std::size_t i = 1; i < samples.size(); ++i) ASSERT_GE(samples[i].time_ns, samples[i - 1].time_ns) << i;
  EXPECT_NEAR(seconds(samples.back().time_ns), 999.0 / 200, 1e-5);
}

TEST(Clock, DoesNotResetAfterAStall) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description);
  Line line;
  line.delay_s = [](int i) { return i >= 1000 && i < 1100 ? (1100 - i) / 200.0 : 0.0; };  // half a second, read at once
  const auto samples = run(clock, description, line, 2000);
  EXPECT_EQ(clock.status().resets, 0u);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_NEAR(seconds(samples[i].time_ns), static_cast<double>(i + 1) / 200, 1e-5);
  }
}

TEST(Clock, RestartsTheFitIfTheCounterRestarts) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description);
  Line before;
  before.first_counter = 30'000;
  run(clock, description, before, 1000);
  Line after;
  after.first_counter = static_cast<std::uint64_t>(65536 * 2 - 1400);  // frame 1400 has counter 0
  std::vector<Sample> samples;
  for (int i = 1400; i < 1800; ++i) {
    if (const auto s = test::pushed(clock, reading_of(description, after, i))) samples.push_back(*s);
  }
  EXPECT_EQ(clock.status().resets, 1u);
  EXPECT_EQ(clock.status().missing_frames, 0u);
  EXPECT_NEAR(seconds(samples.back().time_ns), 1799.0 / 200, 1e-5);
}

}  // namespace
}  // namespace prism::wire
