// SPDX-License-Identifier: MIT
// The reader stalls: buffered bytes arrive at once, the others are lost and counted.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "drivers/wire/decode/frame_decoder.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"
#include "tests/unit/wire/clock_line.hpp"

namespace prism::wire {
namespace {

using test::kEpochNs;

/// A gyro that sends continuously, and a reader that stalls for `stall_s` after 10 s. The line's buffer keeps the first
/// `buffer_bytes` of that time.
struct Stall {
  double stall_s = 5;
  std::size_t buffer_bytes = 4096;
  bool silent = false;     ///< nothing was buffered: the line itself stopped
  std::uint64_t lost = 0;  ///< frames, filled in
  double last_s = 0;       ///< when the last frame was measured, filled in
};

std::vector<Sample> run(const FrameDescriptionPtr& description, drivers::Clock& clock, Stall& stall) {
  FrameEncoder encoder(description);
  FrameDecoder decoder(description);
  const double period_s = description->period_s();
  const GyroState state{
      .rate_deg_per_h = {test::kRateDegPerH}, .interval_s = period_s, .temperature_degc = 25, .uhfo_v = 1};
  std::vector<std::uint8_t> frame, kept;
  std::vector<DecodedMessage> readings;
  std::vector<Sample> samples;
  const auto give = [&](std::vector<std::uint8_t>& bytes, double at_s) {
    decoder.feed(bytes, kEpochNs + std::llround(1e9 * at_s), readings);
    for (const DecodedMessage& reading : readings) {
      if (const auto sample = test::pushed(clock, reading)) samples.push_back(*sample);
    }
    readings.clear();
    bytes.clear();
  };
  const double end_s = 10 + stall.stall_s;
  for (int i = 0; i * period_s < end_s + 10; ++i) {
    const double measured_s = i * period_s;
    const double arrival_s = measured_s + test::wire_s(*description);
    frame.clear();
    encoder.encode(state, frame);
    stall.last_s = measured_s;
    if (arrival_s >= end_s && !kept.empty()) give(kept, end_s);
    if (arrival_s < 10 || arrival_s >= end_s) {
      give(frame, arrival_s);
    } else if (!stall.silent && kept.size() + frame.size() <= stall.buffer_bytes) {
      kept.insert(kept.end(), frame.begin(), frame.end());
    } else {
      ++stall.lost;
    }
  }
  return samples;
}

// At least 6 kB/s through a buffer of 4 kB, counters of 0.1 to 0.5 s, and a stream without a counter.
TEST(ClockStall, CountsEveryFrameLostByTheBuffer) {
  for (const char* name : {"kvh1750", "stim300", "dsp1760", "dsp3000"}) {
    const auto description = test::shipped(name);
    drivers::Clock clock(description);
    Stall stall;
    const auto samples = run(description, clock, stall);
    ASSERT_GT(stall.lost, 100u) << name;
    EXPECT_EQ(clock.status().missing_frames, stall.lost) << name;
    EXPECT_GT(clock.status().missing_by_arrival, stall.lost / 2) << name;
    EXPECT_LE(clock.status().missing_by_arrival, stall.lost) << name;
    EXPECT_EQ(clock.status().resets, 0u) << name;
    EXPECT_NEAR(test::seconds(samples.back().time_ns), stall.last_s, 1e-4) << name;
    std::uint64_t told = 0;
    for (const Sample& sample : samples) told += sample.missing_frames;
    EXPECT_EQ(told, stall.lost) << name;
  }
}

TEST(ClockStall, LosesNothingIfTheBufferIsLargeEnough) {
  for (const char* name : {"kvh1750", "stim300", "dsp1760", "dsp3000", "trplg"}) {
    const auto description = test::shipped(name);
    drivers::Clock clock(description);
    Stall stall{.buffer_bytes = 1 << 20};
    const auto samples = run(description, clock, stall);
    ASSERT_EQ(stall.lost, 0u);
    EXPECT_EQ(clock.status().missing_frames, 0u) << name;
    EXPECT_EQ(clock.status().resets, 0u) << name;
    EXPECT_NEAR(test::seconds(samples.back().time_ns), stall.last_s, 1e-4) << name;
  }
}

TEST(ClockStall, UsesOnlyACounterThatCannotWrap) {
  const auto description = test::shipped("trplg");  // 327 s
  drivers::Clock clock(description);
  Stall stall;
  run(description, clock, stall);
  ASSERT_GT(stall.lost, 100u);
  EXPECT_EQ(clock.status().missing_frames, stall.lost);
  EXPECT_EQ(clock.status().missing_by_arrival, 0u);
}

TEST(ClockStall, CountsAtTheFirstFrameAfterAGap) {
  const auto description = test::shipped("kvh1750");
  drivers::Clock clock(description);
  Stall stall{.silent = true};
  const auto samples = run(description, clock, stall);
  EXPECT_EQ(clock.status().missing_frames, stall.lost);
  EXPECT_NEAR(static_cast<double>(clock.status().missing_by_arrival), static_cast<double>(stall.lost), 128);
  for (const Sample& sample : samples) {
    if (sample.missing_frames == 0) continue;
    EXPECT_NEAR(test::seconds(sample.time_ns), 15, 0.01);
  }
}

// From 25 s on the way is interrupted for 12 s; then the frames follow one by one, each in a chunk of its own.
TEST(ClockStall, FramesThatWaitedOnTheWayKeepTheirDeviceTime) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description, {.source = drivers::ClockSource::kDevice});
  test::Line line;
  line.delay_s = [](int i) { return i < 5000 ? 0 : std::max(0.0, 37 - i / 200.0 + 1e-4 * (i - 5000)); };
  const auto samples = test::run(clock, description, line, 10'000);
  EXPECT_EQ(clock.status().resets, 0u);
  EXPECT_LE(clock.status().missing_frames, 25u) << "0.1 s until it is seen that they waited";
  EXPECT_EQ(samples.size() + clock.status().missing_frames, 9999u);
  for (const Sample& sample : samples) {
    const double frame = 200 * test::seconds(sample.time_ns);
    ASSERT_NEAR(frame, std::round(frame), 1e-3);
  }
  EXPECT_NEAR(test::seconds(samples.back().time_ns), 9999 / 200.0, 1e-6);
}

// The device itself pauses for 12 s and continues with the next count.
TEST(ClockStall, ADevicePausedForLongBeginsASession) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description, {.source = drivers::ClockSource::kDevice});
  test::Line line;
  line.delay_s = [](int i) { return i < 5000 ? 0.0 : 12.0; };
  for (const Sample& sample : test::run(clock, description, line, 10'000)) {
    const double at = test::seconds(sample.time_ns);
    ASSERT_TRUE(at < 25 || at > 37) << at;
  }
  EXPECT_EQ(clock.status().resets, 1u);
}

}  // namespace
}  // namespace prism::wire
