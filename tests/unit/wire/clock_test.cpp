// SPDX-License-Identifier: MIT
// Readings to samples: unwrapped counters, lost frames, rates from angles.
#include "drivers/clock.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/unit/wire/clock_line.hpp"

namespace prism::wire {
namespace {

using test::kEpochNs;
using test::kRateDegPerH;
using test::Line;
using test::reading_of;
using test::run;
using test::seconds;

TEST(Clock, ReturnsTheTimeOfMeasurement) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description);
  const auto samples = run(clock, description, {}, 2000);
  ASSERT_EQ(samples.size(), 1999u);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_NEAR(seconds(samples[i].time_ns), static_cast<double>(i + 1) / 200, 2e-6);
    ASSERT_NEAR(samples[i].interval_s, 0.005, 1e-6);
  }
}

TEST(Clock, CountsMissingFramesAndKeepsTheirAngle) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description);
  Line line;
  line.lost = [](int i) { return i >= 100 && i < 107; };
  const auto samples = run(clock, description, line, 400);
  EXPECT_EQ(clock.status().missing_frames, 7u);
  const auto& after = samples[99];
  EXPECT_EQ(after.missing_frames, 7u);
  EXPECT_NEAR(after.interval_s, 8 * 0.005, 1e-9);
  double angle = 0;
  for (const Sample& s : samples) angle += s.rate_deg_per_h * s.interval_s;
  EXPECT_NEAR(angle, kRateDegPerH * 399 / 200, 0.1 + 1e-9) << "within one pulse";
}

TEST(Clock, MeasuresAGapLongerThanTheCounterByArrival) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description);
  Line line;
  line.lost = [](int i) { return i >= 1000 && i < 81'000; };  // 400 s; the counter wraps after 327.68
  const auto samples = run(clock, description, line, 82'000);
  EXPECT_EQ(clock.status().missing_frames, 80'000u);
  EXPECT_NEAR(seconds(samples.back().time_ns), 81'999.0 / 200, 1e-5);
  EXPECT_EQ(clock.status().resets, 0u);
}

TEST(Clock, UnwrapsTheCounter) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description);
  Line line;
  line.first_counter = 65500;
  const auto samples = run(clock, description, line, 200);
  EXPECT_EQ(clock.status().missing_frames, 0u);
  EXPECT_NEAR(seconds(samples.back().time_ns), 199.0 / 200, 2e-6);
}

TEST(Clock, UnwrapsAnAccumulatedAngle) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description);
  DecodedMessage reading = reading_of(description, {}, 0);
  reading.gyro[0].value = 4294967295.0;
  test::pushed(clock, reading);
  reading = reading_of(description, {}, 1);
  reading.gyro[0].value = 1;
  const auto sample = test::pushed(clock, reading);
  ASSERT_TRUE(sample);
  EXPECT_NEAR(sample->rate_deg_per_h, 2 * 0.1 / 0.005, 1e-6);
}

// A frame of floating-point angles can contain any value with a valid check.
TEST(Clock, UnwrapsAHugeStep) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description);
  DecodedMessage reading = reading_of(description, {}, 0);
  reading.gyro[0].value = 0;
  test::pushed(clock, reading);
  reading = reading_of(description, {}, 1);
  reading.gyro[0].value = 0x1p100;  // a multiple of the wrap
  const auto sample = test::pushed(clock, reading);
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->rate_deg_per_h, 0);
}

TEST(Clock, ReturnsNoSampleForADuplicate) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description);
  test::pushed(clock, reading_of(description, {}, 0));
  test::pushed(clock, reading_of(description, {}, 1));
  EXPECT_FALSE(test::pushed(clock, reading_of(description, {}, 1)));
  EXPECT_EQ(clock.status().duplicates, 1u);
}

TEST(Clock, DeviceTimeDependsOnlyOnFirstArrivalAndCounter) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description, {.source = drivers::ClockSource::kDevice});
  std::mt19937 random(9);
  Line line;
  // a hundred times faster than real time, with jitter
  line.delay_s = [&](int i) { return static_cast<double>(random() % 500) * 1e-3 - 0.99 * i / 200; };
  line.first_counter = 65000;
  const auto samples = run(clock, description, line, 100'000);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_EQ(samples[i].time_ns - samples[0].time_ns, static_cast<std::int64_t>(i) * 5'000'000);
  }
  EXPECT_EQ(clock.status().missing_frames, 0u);
}

TEST(Clock, BeginsASessionIfTheDeviceClockRestarts) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description, {.source = drivers::ClockSource::kDevice});
  test::pushed(clock, reading_of(description, {.first_counter = 100}, 0));
  const auto before = test::pushed(clock, reading_of(description, {.first_counter = 100}, 1));
  EXPECT_FALSE(test::pushed(clock, reading_of(description, {.first_counter = 0}, 2))) << "an angle of another session";
  EXPECT_TRUE(clock.began_session());
  const auto after = test::pushed(clock, reading_of(description, {.first_counter = 0}, 3));
  EXPECT_FALSE(clock.began_session());
  ASSERT_TRUE(before && after);
  EXPECT_EQ(after->time_ns - before->time_ns, 10'000'000) << "by the arrival times";
  EXPECT_EQ(clock.status().resets, 1u);
}

TEST(Clock, ResetStartsANewSession) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description);
  run(clock, description, {}, 100);
  clock.reset();
  DecodedMessage reading = reading_of(description, {}, 0);
  reading.arrival_ns -= 3'600'000'000'000;
  EXPECT_FALSE(test::pushed(clock, reading));
  reading.arrival_ns += 5'000'000;
  reading.counter = 1;
  const auto sample = test::pushed(clock, reading);
  ASSERT_TRUE(sample);
  EXPECT_LT(sample->time_ns, kEpochNs);
}

TEST(Clock, CountsFramesWithoutACounter) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description);
  std::vector<Sample> samples;
  for (int i = 0; i < 500; ++i) {
    DecodedMessage reading = reading_of(description, {}, i);
    reading.has_counter = false;
    reading.counter = 0;
    if (i == 100) continue;  // its 20 bytes were damaged: the offset shows it
    if (const auto sample = test::pushed(clock, reading)) samples.push_back(*sample);
  }
  EXPECT_EQ(clock.status().missing_frames, 1u);
  EXPECT_NEAR(seconds(samples.back().time_ns), 499.0 / 200, 2e-6);
}

TEST(Clock, IgnoresAnUncountedReading) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description);
  std::vector<Sample> samples;
  for (int i = 0; i < 300; ++i) {
    const DecodedMessage reading = reading_of(description, {.first_counter = 40'000}, i);
    if (const auto sample = test::pushed(clock, reading)) samples.push_back(*sample);
    DecodedMessage other = reading;
    other.has_counter = other.has_gyro = false;
    other.counter = 0;
    EXPECT_FALSE(test::pushed(clock, other));
  }
  EXPECT_EQ(clock.status().missing_frames, 0u);
  EXPECT_EQ(clock.status().resets, 0u);
  EXPECT_NEAR(seconds(samples.back().time_ns), 299.0 / 200, 2e-6);
}

// HG4930: six messages a delta angle, a two-bit counter over all of them, temperature in every other status word.
TEST(Clock, MessageTypesShareACounter) {
  const auto description = test::shipped("hg4930");
  FrameEncoder encoder(description);
  FrameDecoder decoder(description);
  drivers::Clock clock(description);
  std::vector<std::uint8_t> bytes;
  std::vector<DecodedMessage> readings;
  std::vector<Sample> samples;
  for (int i = 0; i < 6000; ++i) {
    bytes.clear();
    encoder.encode({.rate_deg_per_h = {3600}, .interval_s = 1.0 / 600, .temperature_degc = 31}, bytes);
    readings.clear();
    decoder.feed(bytes, kEpochNs + std::llround(i * 1e9 / 600), readings);
    for (const DecodedMessage& reading : readings) {
      if (const auto sample = test::pushed(clock, reading)) samples.push_back(*sample);
    }
  }
  ASSERT_EQ(samples.size(), 1000u);
  EXPECT_EQ(clock.status().missing_frames, 0u);
  EXPECT_NEAR(samples.back().interval_s, 0.01, 1e-6);
  EXPECT_EQ(samples.back().temperature_degc, 31);
  double angle = 0;
  for (const Sample& sample : samples) angle += sample.rate_deg_per_h * sample.interval_s;
  EXPECT_NEAR(angle, 36'000, 0.1);
  EXPECT_NEAR(seconds(samples.back().time_ns - samples.front().time_ns + kEpochNs), 9.99, 1e-4);
}

TEST(Clock, TriggeredIncrementCoversTheCounterStep) {
  std::string text = test::read_file(test::frames_dir() / "trplg-increment.json");
  const std::string counter = "\"counter\": {\"field\": \"counter\",";
  text.replace(text.find(counter), counter.size(), counter + " \"ticks_per_s\": 2000, \"step_varies\": true,");
  const auto description = test::description_of(text);
  drivers::Clock clock(description);
  DecodedMessage reading = reading_of(description, {}, 0);
  test::pushed(clock, reading);
  for (const int step : {10, 25, 7}) {  // samples at 2000 Hz between triggers
    reading.counter += static_cast<std::uint64_t>(step);
    reading.arrival_ns += step * 500'000;
    reading.gyro[0].value = 100;
    const auto sample = test::pushed(clock, reading);
    ASSERT_TRUE(sample);
    EXPECT_NEAR(sample->interval_s, step / 2000.0, 1e-9);
    EXPECT_NEAR(sample->rate_deg_per_h, 100 * 0.1 / (step / 2000.0), 1e-6);
  }
  EXPECT_EQ(clock.status().missing_frames, 0u);
}

TEST(Clock, NextFrameHasTheAngleOfAnInvalidOne) {
  const auto description = test::shipped("trplg");
  drivers::Clock clock(description);
  test::pushed(clock, reading_of(description, {}, 0));
  DecodedMessage bad = reading_of(description, {}, 1);
  bad.gyro[0].valid = false;
  const auto invalid = test::pushed(clock, bad);
  ASSERT_TRUE(invalid);
  EXPECT_TRUE(std::isnan(invalid->rate_deg_per_h));
  DecodedMessage good = reading_of(description, {}, 2);
  good.gyro[0].value = 3;
  const auto valid = test::pushed(clock, good);
  ASSERT_TRUE(valid);
  EXPECT_NEAR(valid->rate_deg_per_h * valid->interval_s, 0.3, 1e-9);
  EXPECT_NEAR(valid->interval_s, 0.010, 1e-9);
}

}  // namespace
}  // namespace prism::wire
