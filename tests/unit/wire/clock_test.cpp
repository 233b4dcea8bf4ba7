// SPDX-License-Identifier: MIT
// Time one can trust: counters unwrapped, jitter seen through, the true period found, restarts survived.
#include "drivers/clock.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "tests/unit/wire/descriptions.hpp"

namespace prism {
namespace {

constexpr std::int64_t kEpochNs = 1'700'000'000'000'000'000;
constexpr double kRateDegPerH = 8.4652;

/// What a gyro sends, and when it arrives: the truth of these tests.
struct Line {
  double true_rate_hz = 200;
  double nominal_rate_hz = 200;
  std::function<double(int)> delay_s = [](int) { return 0.0; };
  std::function<bool(int)> lost = [](int) { return false; };
  std::uint64_t first_counter = 0;
};

double wire_s(const FrameDescription& description) { return 1e-9 * description.wire.byte_time_ns() * description.max_frame_bytes; }

/// Frame i is measured at i / true_rate and arrives one wire time and its delay later.
Reading reading_of(const FrameDescriptionPtr& description, const Line& line, int i) {
  const double measured_s = i / line.true_rate_hz;
  Reading reading;
  reading.length = description->max_frame_bytes;
  reading.offset = static_cast<std::uint64_t>(i) * reading.length;
  reading.arrival_ns = kEpochNs + std::llround(1e9 * (measured_s + wire_s(*description) + line.delay_s(i)));
  reading.has_gyro = reading.has_counter = reading.valid = true;
  reading.counter = (line.first_counter + static_cast<std::uint64_t>(i)) % description->counter->modulus;
  const double pulses = std::floor(kRateDegPerH * measured_s / description->gyro.scale);
  reading.gyro = std::fmod(pulses, 4294967296.0);
  reading.temperature_degc = 25;
  return reading;
}

std::vector<Sample> run(Clock& clock, const FrameDescriptionPtr& description, const Line& line, int frames) {
  std::vector<Sample> samples;
  for (int i = 0; i < frames; ++i) {
    if (line.lost(i)) continue;
    if (const auto sample = clock.push(reading_of(description, line, i))) samples.push_back(*sample);
  }
  return samples;
}

double seconds(std::int64_t time_ns) { return 1e-9 * static_cast<double>(time_ns - kEpochNs); }

TEST(Clock, ACleanLineGivesTheTimeOfMeasurement) {
  const auto description = test::shipped("trplg");
  Clock clock(description);
  const auto samples = run(clock, description, {}, 2000);
  ASSERT_EQ(samples.size(), 1999u);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_NEAR(seconds(samples[i].time_ns), static_cast<double>(i + 1) / 200, 2e-6);
    ASSERT_NEAR(samples[i].interval_s, 0.005, 1e-6);
  }
}

TEST(Clock, MissingFramesAreKnownAndTheirAngleIsNotLost) {
  const auto description = test::shipped("trplg");
  Clock clock(description);
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

TEST(Clock, ASilenceLongerThanTheCounterIsMeasuredByTheArrival) {
  const auto description = test::shipped("trplg");
  Clock clock(description);
  Line line;
  line.lost = [](int i) { return i >= 1000 && i < 81'000; };  // 400 s; the counter wraps after 327.68
  const auto samples = run(clock, description, line, 82'000);
  EXPECT_EQ(clock.status().missing_frames, 80'000u);
  EXPECT_NEAR(seconds(samples.back().time_ns), 81'999.0 / 200, 1e-5);
  EXPECT_EQ(clock.status().resets, 0u);
}

TEST(Clock, TheCounterWrapsWithoutATrace) {
  const auto description = test::shipped("trplg");
  Clock clock(description);
  Line line;
  line.first_counter = 65500;
  const auto samples = run(clock, description, line, 200);
  EXPECT_EQ(clock.status().missing_frames, 0u);
  EXPECT_NEAR(seconds(samples.back().time_ns), 199.0 / 200, 2e-6);
}

TEST(Clock, AnAccumulatedAngleWrapsWithoutATrace) {
  const auto description = test::shipped("trplg");
  Clock clock(description);
  Reading reading = reading_of(description, {}, 0);
  reading.gyro = 4294967295.0;
  clock.push(reading);
  reading = reading_of(description, {}, 1);
  reading.gyro = 1;
  const auto sample = clock.push(reading);
  ASSERT_TRUE(sample);
  EXPECT_NEAR(sample->rate_deg_per_h, 2 * 0.1 / 0.005, 1e-6);
}

TEST(Clock, ADuplicateGivesNoSample) {
  const auto description = test::shipped("trplg");
  Clock clock(description);
  clock.push(reading_of(description, {}, 0));
  clock.push(reading_of(description, {}, 1));
  EXPECT_FALSE(clock.push(reading_of(description, {}, 1)));
  EXPECT_EQ(clock.status().duplicates, 1u);
}

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

// A USB adapter that hands over what came in 16 ms at once.
double batched(double t) { return std::ceil(t / 0.016) * 0.016 - t; }

TEST(Clock, JitterOfAUartIsSeenThrough) {
  const auto description = test::shipped("trplg");
  Clock clock(description);
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

TEST(Clock, BatchesOfAUsbAdapterAreSeenThrough) {
  const auto description = test::shipped("trplg");
  Clock clock(description);
  Line line;
  line.true_rate_hz = 200.013;
  line.delay_s = [&](int i) { return batched(i / 200.013 + 0.0003); };
  const auto samples = run(clock, description, line, 240 * 200);
  const auto [rms, worst] = stamp_error(samples, line.true_rate_hz);
  EXPECT_LT(rms, 400e-6);
  EXPECT_LT(worst, 800e-6);
  EXPECT_EQ(clock.status().resets, 0u);
}

/// trplg at another nominal rate, from a device whose clock may be off by 5 %.
FrameDescriptionPtr loose_thousand_hz() {
  std::string text = test::read_file(test::frames_dir() / "trplg.json");
  text.replace(text.find("\"rate_hz\": 200"), 14, "\"rate_hz\": 1000");
  text.replace(text.find("\"rate_tolerance\": "), 24, "\"rate_tolerance\": 0.05,");
  return test::description_of(text);
}

// yoos/kvh_1750_troubleshooting: an IMU on its internal clock ran at 962.4 Hz instead of 1000, and angles that were
// computed with the nominal rate were 3.9 % short.
TEST(Clock, AGyroThatRunsAt962HzInsteadOf1000GetsItsRatesRight) {
  const auto description = loose_thousand_hz();
  Clock clock(description);
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

TEST(Clock, AStallDoesNotCostTheEstimateOfThePeriod) {
  const auto description = loose_thousand_hz();
  Clock clock(description);
  Line line;
  line.true_rate_hz = 962.4;
  line.delay_s = [](int i) { return i >= 2000 && i < 2400 ? (2400 - i) / 962.4 : 0.0; };
  run(clock, description, line, 10'000);
  EXPECT_NEAR(clock.status().period_s * 962.4, 1, 1e-5);
  EXPECT_EQ(clock.status().resets, 0u);
}

TEST(Clock, TheWindowsForgetAnOldPeriod) {
  const auto description = test::shipped("trplg");
  Clock clock(description, {.switch_s = 20});
  // The device's clock gets faster by 1e-4 after a minute: 5 us less a frame.
  double measured_s = 0;
  std::optional<Sample> last;
  for (int i = 0; i < 40'000; ++i) {
    measured_s += i < 12'000 ? 1.0 / 200 : 1.0 / 200.02;
    Reading reading = reading_of(description, {}, i);
    reading.arrival_ns = kEpochNs + std::llround(1e9 * (measured_s + wire_s(*description)));
    last = clock.push(reading);
  }
  ASSERT_TRUE(last);
  EXPECT_NEAR(clock.status().period_s * 200.02, 1, 1e-9);
  EXPECT_NEAR(seconds(last->time_ns), measured_s, 2e-6);
}

TEST(Clock, AWrongFirstStampDoesNotPoisonTheRest) {
  const auto description = test::shipped("trplg");
  for (const double wrong_s : {86'400.0, 0.3, -86'400.0, -0.3}) {
    Clock clock(description);
    Line line;
    line.delay_s = [&](int i) { return i == 0 ? wrong_s : 0.0; };
    const auto samples = run(clock, description, line, 1000);
    EXPECT_NEAR(seconds(samples.back().time_ns), 999.0 / 200, 1e-5) << "first stamp wrong by " << wrong_s << " s";
    for (std::size_t i = 1; i < samples.size() && wrong_s < 1; ++i) ASSERT_GE(samples[i].time_ns, samples[i - 1].time_ns);
    EXPECT_EQ(clock.status().resets, 1u);
  }
}

TEST(Clock, StampsWaitRatherThanGoBack) {
  const auto description = test::shipped("trplg");
  Clock clock(description);
  Line line;
  line.delay_s = [](int i) { return i < 40 ? 0.3 : 0.0; };  // a backlog, read at once when the line was opened
  const auto samples = run(clock, description, line, 1000);
  for (std::size_t i = 1; i < samples.size(); ++i) ASSERT_GE(samples[i].time_ns, samples[i - 1].time_ns) << i;
  EXPECT_NEAR(seconds(samples.back().time_ns), 999.0 / 200, 1e-5);
}

TEST(Clock, AStalledHostIsNoReset) {
  const auto description = test::shipped("trplg");
  Clock clock(description);
  Line line;
  line.delay_s = [](int i) { return i >= 1000 && i < 1100 ? (1100 - i) / 200.0 : 0.0; };  // half a second, read at once
  const auto samples = run(clock, description, line, 2000);
  EXPECT_EQ(clock.status().resets, 0u);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_NEAR(seconds(samples[i].time_ns), static_cast<double>(i + 1) / 200, 1e-5);
  }
}

TEST(Clock, ARestartedCounterBeginsANewFit) {
  const auto description = test::shipped("trplg");
  Clock clock(description);
  Line before;
  before.first_counter = 30'000;
  run(clock, description, before, 1000);
  Line after;
  after.first_counter = static_cast<std::uint64_t>(65536 * 2 - 1400);  // frame 1400 has counter 0
  std::vector<Sample> samples;
  for (int i = 1400; i < 1800; ++i) {
    if (const auto s = clock.push(reading_of(description, after, i))) samples.push_back(*s);
  }
  EXPECT_EQ(clock.status().resets, 1u);
  EXPECT_EQ(clock.status().missing_frames, 0u);
  EXPECT_NEAR(seconds(samples.back().time_ns), 1799.0 / 200, 1e-5);
}

TEST(Clock, DeviceTimeDependsOnTheFirstArrivalAndTheCounterOnly) {
  const auto description = test::shipped("trplg");
  Clock clock(description, {.source = ClockSource::kDevice});
  std::mt19937 random(9);
  Line line;
  line.delay_s = [&](int i) { return i == 0 ? 0.0 : static_cast<double>(random() % 1000) - i / 200.0; };
  line.first_counter = 65000;
  const auto samples = run(clock, description, line, 100'000);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_EQ(samples[i].time_ns - samples[0].time_ns, static_cast<std::int64_t>(i) * 5'000'000);
  }
  EXPECT_EQ(clock.status().missing_frames, 0u);
}

TEST(Clock, ARestartedDeviceClockGoesOnByOneFrame) {
  const auto description = test::shipped("trplg");
  Clock clock(description, {.source = ClockSource::kDevice});
  clock.push(reading_of(description, {.first_counter = 100}, 0));
  const auto before = clock.push(reading_of(description, {.first_counter = 100}, 1));
  EXPECT_FALSE(clock.push(reading_of(description, {.first_counter = 0}, 2))) << "an angle of another session";
  const auto after = clock.push(reading_of(description, {.first_counter = 0}, 3));
  ASSERT_TRUE(before && after);
  EXPECT_EQ(after->time_ns - before->time_ns, 10'000'000);
  EXPECT_EQ(clock.status().resets, 1u);
}

TEST(Clock, ResetStartsASessionThatMayBeginAnywhere) {
  const auto description = test::shipped("trplg");
  Clock clock(description);
  run(clock, description, {}, 100);
  clock.reset();
  Reading reading = reading_of(description, {}, 0);
  reading.arrival_ns -= 3'600'000'000'000;
  EXPECT_FALSE(clock.push(reading));
  reading.arrival_ns += 5'000'000;
  reading.counter = 1;
  const auto sample = clock.push(reading);
  ASSERT_TRUE(sample);
  EXPECT_LT(sample->time_ns, kEpochNs);
}

TEST(Clock, AStreamWithoutItsCounterGoesOnByFrames) {
  const auto description = test::shipped("trplg");
  Clock clock(description);
  std::vector<Sample> samples;
  for (int i = 0; i < 500; ++i) {
    Reading reading = reading_of(description, {}, i);
    reading.has_counter = false;
    reading.counter = 0;
    if (i == 100) continue;  // its 20 bytes were damaged: the offset tells
    if (const auto sample = clock.push(reading)) samples.push_back(*sample);
  }
  EXPECT_EQ(clock.status().missing_frames, 1u);
  EXPECT_NEAR(seconds(samples.back().time_ns), 499.0 / 200, 2e-6);
}

TEST(Clock, AnUncountedReadingBetweenCountedOnesDoesNotDisturbTheCounter) {
  const auto description = test::shipped("trplg");
  Clock clock(description);
  std::vector<Sample> samples;
  for (int i = 0; i < 300; ++i) {
    const Reading reading = reading_of(description, {.first_counter = 40'000}, i);
    if (const auto sample = clock.push(reading)) samples.push_back(*sample);
    Reading other = reading;
    other.has_counter = other.has_gyro = false;
    other.counter = 0;
    EXPECT_FALSE(clock.push(other));
  }
  EXPECT_EQ(clock.status().missing_frames, 0u);
  EXPECT_EQ(clock.status().resets, 0u);
  EXPECT_NEAR(seconds(samples.back().time_ns), 299.0 / 200, 2e-6);
}

// HG4930: six messages a delta angle, a two-bit counter over all of them, temperature in every other status word.
TEST(Clock, MessagesOfSeveralKindsShareACounter) {
  const auto description = test::shipped("hg4930");
  FrameEncoder encoder(description);
  FrameDecoder decoder(description);
  Clock clock(description);
  std::vector<std::uint8_t> bytes;
  std::vector<Reading> readings;
  std::vector<Sample> samples;
  for (int i = 0; i < 6000; ++i) {
    bytes.clear();
    encoder.encode({.rate_deg_per_h = 3600, .interval_s = 1.0 / 600, .temperature_degc = 31}, bytes);
    readings.clear();
    decoder.feed(bytes, kEpochNs + std::llround(i * 1e9 / 600), readings);
    for (const Reading& reading : readings) {
      if (const auto sample = clock.push(reading)) samples.push_back(*sample);
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

TEST(Clock, AnExternallyTriggeredIncrementCoversTheStepOfTheCounter) {
  std::string text = test::read_file(test::frames_dir() / "trplg-increment.json");
  const std::string counter = "\"counter\": {\"field\": \"counter\",";
  text.replace(text.find(counter), counter.size(), counter + " \"ticks_per_s\": 2000, \"step_varies\": true,");
  const auto description = test::description_of(text);
  Clock clock(description);
  Reading reading = reading_of(description, {}, 0);
  clock.push(reading);
  for (const int step : {10, 25, 7}) {  // samples at 2000 Hz between triggers
    reading.counter += static_cast<std::uint64_t>(step);
    reading.arrival_ns += step * 500'000;
    reading.gyro = 100;
    const auto sample = clock.push(reading);
    ASSERT_TRUE(sample);
    EXPECT_NEAR(sample->interval_s, step / 2000.0, 1e-9);
    EXPECT_NEAR(sample->rate_deg_per_h, 100 * 0.1 / (step / 2000.0), 1e-6);
  }
  EXPECT_EQ(clock.status().missing_frames, 0u);
}

TEST(Clock, AnInvalidFrameHasNoRateAndTheNextOneHasTheWholeAngle) {
  const auto description = test::shipped("trplg");
  Clock clock(description);
  clock.push(reading_of(description, {}, 0));
  Reading bad = reading_of(description, {}, 1);
  bad.valid = false;
  const auto invalid = clock.push(bad);
  ASSERT_TRUE(invalid);
  EXPECT_TRUE(std::isnan(invalid->rate_deg_per_h));
  Reading good = reading_of(description, {}, 2);
  good.gyro = 3;
  const auto valid = clock.push(good);
  ASSERT_TRUE(valid);
  EXPECT_NEAR(valid->rate_deg_per_h * valid->interval_s, 0.3, 1e-9);
  EXPECT_NEAR(valid->interval_s, 0.010, 1e-9);
}

}  // namespace
}  // namespace prism
