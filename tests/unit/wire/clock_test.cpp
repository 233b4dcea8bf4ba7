// SPDX-License-Identifier: MIT
// Readings to samples: unwrapped counters, lost frames, rates from angles, accurate stamps, stalls of the reader.
#include "drivers/clock.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <random>

#include "drivers/wire/decode/frame_decoder.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

constexpr std::int64_t kEpochNs = 1'700'000'000'000'000'000;
constexpr double kTrueRateDegPerH = 8.4652;

/// Frames of a gyro and their arrival times: the truth of these tests.
struct Line {
  double true_rate_hz = 200;
  double nominal_rate_hz = 200;
  std::function<double(int)> delay_s = [](int) { return 0.0; };
  std::function<bool(int)> lost = [](int) { return false; };
  std::uint64_t first_counter = 0;
};

double wire_s(const FrameDescription& description) {
  return 1e-9 * description.wire.byte_time_ns() * description.max_frame_bytes;
}

/// Frame i is measured at i / true_rate and arrives one wire time and its delay later.
DecodedMessage reading_of(const FrameDescriptionPtr& description, const Line& line, int i) {
  const double measured_s = i / line.true_rate_hz;
  DecodedMessage reading;
  reading.length = description->max_frame_bytes;
  reading.offset = static_cast<std::uint64_t>(i) * reading.length;
  reading.arrival_ns = kEpochNs + std::llround(1e9 * (measured_s + wire_s(*description) + line.delay_s(i)));
  reading.has_gyro = reading.has_counter = reading.gyro[0].carried = reading.gyro[0].valid = true;
  reading.counter = (line.first_counter + static_cast<std::uint64_t>(i)) % description->counter->modulus;
  const double pulses = std::floor(kTrueRateDegPerH * measured_s / description->axes[0].scale);
  reading.gyro[0].value = std::fmod(pulses, 4294967296.0);
  reading.temperature_degc = 25;
  return reading;
}

/// The sample of the first axis.
std::optional<Sample> pushed(drivers::Clock& clock, const DecodedMessage& reading) {
  return clock.push(reading) ? clock.sample(reading, 0) : std::nullopt;
}

std::vector<Sample> run(drivers::Clock& clock, const FrameDescriptionPtr& description, const Line& line, int frames) {
  std::vector<Sample> samples;
  for (int i = 0; i < frames; ++i) {
    if (line.lost(i)) continue;
    if (const auto sample = pushed(clock, reading_of(description, line, i))) samples.push_back(*sample);
  }
  return samples;
}

double seconds(std::int64_t time_ns) { return 1e-9 * static_cast<double>(time_ns - kEpochNs); }

/// trplg at another nominal rate, from a device whose clock has an error up to 5 %.
FrameDescriptionPtr loose_thousand_hz() {
  std::string text = test::read_file(test::frames_dir() / "trplg.json");
  text.replace(text.find("\"rate_hz\": 200"), 14, "\"rate_hz\": 1000");
  text.replace(text.find("\"rate_tolerance\": "), 24, "\"rate_tolerance\": 0.05,");
  return test::description_of(text);
}

struct Clock : testing::Test {
  FrameDescriptionPtr description = test::shipped("trplg");
  drivers::Clock clock{description};
  Line line;
};
using ClockStall = Clock;

TEST_F(Clock, ReturnsTheTimeOfMeasurement) {
  const auto samples = run(clock, description, {}, 2000);
  ASSERT_EQ(samples.size(), 1999u);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_NEAR(seconds(samples[i].time_ns), static_cast<double>(i + 1) / 200, 2e-6);
    ASSERT_NEAR(samples[i].interval_s, 0.005, 1e-6);
  }
}

TEST_F(Clock, CountsMissingFramesAndKeepsTheirAngle) {
  line.lost = [](int i) { return i >= 100 && i < 107; };
  const auto samples = run(clock, description, line, 400);
  EXPECT_EQ(clock.status().missing_frames, 7u);
  const auto& after = samples[99];
  EXPECT_EQ(after.missing_frames, 7u);
  EXPECT_NEAR(after.interval_s, 8 * 0.005, 1e-9);
  double angle = 0;
  for (const Sample& s : samples) angle += s.rate_deg_per_h * s.interval_s;
  EXPECT_NEAR(angle, kTrueRateDegPerH * 399 / 200, 0.1 + 1e-9) << "within one pulse";
}

TEST_F(Clock, MeasuresAGapLongerThanTheCounterByArrival) {
  line.lost = [](int i) { return i >= 1000 && i < 81'000; };  // 400 s; the counter wraps after 327.68
  const auto samples = run(clock, description, line, 82'000);
  EXPECT_EQ(clock.status().missing_frames, 80'000u);
  EXPECT_NEAR(seconds(samples.back().time_ns), 81'999.0 / 200, 1e-5);
  EXPECT_EQ(clock.status().resets, 0u);
}

TEST_F(Clock, UnwrapsTheCounter) {
  line.first_counter = 65500;
  const auto samples = run(clock, description, line, 200);
  EXPECT_EQ(clock.status().missing_frames, 0u);
  EXPECT_NEAR(seconds(samples.back().time_ns), 199.0 / 200, 2e-6);
}

TEST_F(Clock, UnwrapsAnAccumulatedAngle) {
  DecodedMessage reading = reading_of(description, {}, 0);
  reading.gyro[0].value = 4294967295.0;
  pushed(clock, reading);
  reading = reading_of(description, {}, 1);
  reading.gyro[0].value = 1;
  const auto sample = pushed(clock, reading);
  ASSERT_TRUE(sample);
  EXPECT_NEAR(sample->rate_deg_per_h, 2 * 0.1 / 0.005, 1e-6);
}

// A frame of floating-point angles can contain any value with a valid check.
TEST_F(Clock, UnwrapsAHugeStep) {
  DecodedMessage reading = reading_of(description, {}, 0);
  reading.gyro[0].value = 0;
  pushed(clock, reading);
  reading = reading_of(description, {}, 1);
  reading.gyro[0].value = 0x1p100;  // a multiple of the wrap
  const auto sample = pushed(clock, reading);
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->rate_deg_per_h, 0);
}

TEST_F(Clock, ReturnsNoSampleForADuplicate) {
  pushed(clock, reading_of(description, {}, 0));
  pushed(clock, reading_of(description, {}, 1));
  EXPECT_FALSE(pushed(clock, reading_of(description, {}, 1)));
  EXPECT_EQ(clock.status().duplicates, 1u);
}

TEST_F(Clock, DeviceTimeDependsOnlyOnFirstArrivalAndCounter) {
  clock = drivers::Clock(description, {.source = drivers::ClockSource::kDevice});
  std::mt19937 random(9);
  // a hundred times faster than real time, with jitter
  line.delay_s = [&](int i) { return static_cast<double>(random() % 500) * 1e-3 - 0.99 * i / 200; };
  line.first_counter = 65000;
  const auto samples = run(clock, description, line, 100'000);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_EQ(samples[i].time_ns - samples[0].time_ns, static_cast<std::int64_t>(i) * 5'000'000);
  }
  EXPECT_EQ(clock.status().missing_frames, 0u);
}

TEST_F(Clock, BeginsASessionIfTheDeviceClockRestarts) {
  clock = drivers::Clock(description, {.source = drivers::ClockSource::kDevice});
  pushed(clock, reading_of(description, {.first_counter = 100}, 0));
  const auto before = pushed(clock, reading_of(description, {.first_counter = 100}, 1));
  EXPECT_FALSE(pushed(clock, reading_of(description, {.first_counter = 0}, 2))) << "an angle of another session";
  EXPECT_TRUE(clock.began_session());
  const auto after = pushed(clock, reading_of(description, {.first_counter = 0}, 3));
  EXPECT_FALSE(clock.began_session());
  ASSERT_TRUE(before && after);
  EXPECT_EQ(after->time_ns - before->time_ns, 10'000'000) << "by the arrival times";
  EXPECT_EQ(clock.status().resets, 1u);
}

TEST_F(Clock, ResetStartsANewSession) {
  run(clock, description, {}, 100);
  clock.reset();
  DecodedMessage reading = reading_of(description, {}, 0);
  reading.arrival_ns -= 3'600'000'000'000;
  EXPECT_FALSE(pushed(clock, reading));
  reading.arrival_ns += 5'000'000;
  reading.counter = 1;
  const auto sample = pushed(clock, reading);
  ASSERT_TRUE(sample);
  EXPECT_LT(sample->time_ns, kEpochNs);
}

TEST_F(Clock, CountsFramesWithoutACounter) {
  std::vector<Sample> samples;
  for (int i = 0; i < 500; ++i) {
    DecodedMessage reading = reading_of(description, {}, i);
    reading.has_counter = false;
    reading.counter = 0;
    if (i == 100) continue;  // its check failed
    if (i == 101) reading.damaged = 1;
    if (const auto sample = pushed(clock, reading)) samples.push_back(*sample);
  }
  EXPECT_EQ(clock.status().missing_frames, 1u);
  EXPECT_NEAR(seconds(samples.back().time_ns), 499.0 / 200, 2e-6);
}

/// A gyro of 10 Hz without a counter, for 20 minutes; `between` is what its device sends before frame i, `damage` what
/// the line does to a frame.
struct Uncounted {
  std::uint64_t missing = 0;
  bool clocks_differ = false;
  double length_s = 0;

  Uncounted(const std::function<std::string(int)>& between,
            const std::function<void(int, std::vector<std::uint8_t>&)>& damage) {
    const auto description = test::description_of(R"({"format": "prism-frames", "version": 1, "name": "plain",
      "line": {"baud": 115200}, "rate_hz": 10, "kinds": [{"name": "k", "sync": {"bytes": "AB CD"}, "length": 10,
      "checks": {"kind": "crc", "width": 16, "poly": "0x1021", "to": -2, "at": -2},
      "fields": {"rate": {"at": 2, "type": "s32"}, "t": {"at": 6, "type": "s16"}}}],
      "gyro": {"meaning": "rate", "unit": "deg/h", "axes": {"z": "rate"}}, "temperature": {"field": "t"}})");
    FrameDecoder decoder(description);
    FrameEncoder encoder(description);
    drivers::Clock clock(description, {.source = drivers::ClockSource::kHost});
    std::vector<DecodedMessage> readings;
    std::int64_t first_ns = 0, last_ns = 0;
    for (int i = 0; i < 12'000; ++i) {
      const std::string text = between(i);
      std::vector<std::uint8_t> frame, bytes(text.begin(), text.end());
      encoder.encode({.rate_deg_per_h = {10}, .interval_s = 0.1, .temperature_degc = 20}, frame);
      damage(i, frame);
      bytes.insert(bytes.end(), frame.begin(), frame.end());
      readings.clear();
      decoder.feed(bytes, kEpochNs + 100'000'000LL * i, readings);
      for (const DecodedMessage& reading : readings) {
        const auto sample = pushed(clock, reading);
        if (!sample) continue;
        if (first_ns == 0) first_ns = sample->time_ns;
        last_ns = sample->time_ns;
        clocks_differ = clocks_differ || sample->clocks_differ;
      }
    }
    missing = clock.status().missing_frames;
    length_s = 1e-9 * static_cast<double>(last_ns - first_ns);
  }
};

// Version 0.3 took the sentence for seven lost frames a second: not a row was corrected.
TEST(UncountedFrames, OtherBytesOfTheDeviceAreNoLostFrames) {
  const Uncounted found([](int i) { return i % 10 == 0 ? "$GPZDA,091100.00,23,11,2026,00,00*6A\r\n" : ""; },
                        [](int, std::vector<std::uint8_t>&) {});
  EXPECT_EQ(found.missing, 0u);
  EXPECT_FALSE(found.clocks_differ);
  EXPECT_NEAR(found.length_s, 1199.9, 1e-3);
}

TEST(UncountedFrames, AFrameWhoseCheckFailsIsLost) {
  int damaged = 0;
  const Uncounted found([](int) { return ""; },
                        [&](int i, std::vector<std::uint8_t>& frame) {
                          if (i % 20 != 7) return;
                          frame[2 + static_cast<std::size_t>(i / 20) % 8] ^= 0x55;
                          ++damaged;
                        });
  EXPECT_EQ(found.missing, static_cast<std::uint64_t>(damaged));
  EXPECT_FALSE(found.clocks_differ);
  EXPECT_NEAR(found.length_s, 1199.9, 1e-3);
}

TEST_F(Clock, IgnoresAnUncountedReading) {
  std::vector<Sample> samples;
  for (int i = 0; i < 300; ++i) {
    const DecodedMessage reading = reading_of(description, {.first_counter = 40'000}, i);
    if (const auto sample = pushed(clock, reading)) samples.push_back(*sample);
    DecodedMessage other = reading;
    other.has_counter = other.has_gyro = false;
    other.counter = 0;
    EXPECT_FALSE(pushed(clock, other));
  }
  EXPECT_EQ(clock.status().missing_frames, 0u);
  EXPECT_EQ(clock.status().resets, 0u);
  EXPECT_NEAR(seconds(samples.back().time_ns), 299.0 / 200, 2e-6);
}

// HG4930: six messages a delta angle, a two-bit counter over all of them, temperature in every other status word.
TEST_F(Clock, MessageTypesShareACounter) {
  description = test::shipped("hg4930");
  FrameEncoder encoder(description);
  FrameDecoder decoder(description);
  clock = drivers::Clock(description);
  std::vector<std::uint8_t> bytes;
  std::vector<DecodedMessage> readings;
  std::vector<Sample> samples;
  for (int i = 0; i < 6000; ++i) {
    bytes.clear();
    encoder.encode({.rate_deg_per_h = {3600}, .interval_s = 1.0 / 600, .temperature_degc = 31}, bytes);
    readings.clear();
    decoder.feed(bytes, kEpochNs + std::llround(i * 1e9 / 600), readings);
    for (const DecodedMessage& reading : readings) {
      if (const auto sample = pushed(clock, reading)) samples.push_back(*sample);
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

TEST_F(Clock, TriggeredIncrementCoversTheCounterStep) {
  std::string text = test::read_file(test::frames_dir() / "trplg-increment.json");
  const std::string counter = "\"counter\": {\"field\": \"counter\",";
  text.replace(text.find(counter), counter.size(), counter + " \"ticks_per_s\": 2000, \"step_varies\": true,");
  description = test::description_of(text);
  clock = drivers::Clock(description);
  DecodedMessage reading = reading_of(description, {}, 0);
  pushed(clock, reading);
  for (const int step : {10, 25, 7}) {  // samples at 2000 Hz between triggers
    reading.counter += static_cast<std::uint64_t>(step);
    reading.arrival_ns += step * 500'000;
    reading.gyro[0].value = 100;
    const auto sample = pushed(clock, reading);
    ASSERT_TRUE(sample);
    EXPECT_NEAR(sample->interval_s, step / 2000.0, 1e-9);
    EXPECT_NEAR(sample->rate_deg_per_h, 100 * 0.1 / (step / 2000.0), 1e-6);
  }
  EXPECT_EQ(clock.status().missing_frames, 0u);
}

TEST_F(Clock, NextFrameHasTheAngleOfAnInvalidOne) {
  pushed(clock, reading_of(description, {}, 0));
  DecodedMessage bad = reading_of(description, {}, 1);
  bad.gyro[0].valid = false;
  const auto invalid = pushed(clock, bad);
  ASSERT_TRUE(invalid);
  EXPECT_TRUE(std::isnan(invalid->rate_deg_per_h));
  DecodedMessage good = reading_of(description, {}, 2);
  good.gyro[0].value = 3;
  const auto valid = pushed(clock, good);
  ASSERT_TRUE(valid);
  EXPECT_NEAR(valid->rate_deg_per_h * valid->interval_s, 0.3, 1e-9);
  EXPECT_NEAR(valid->interval_s, 0.010, 1e-9);
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

// A USB adapter that delivers the bytes of 16 ms at once.
double batched(double t) { return std::ceil(t / 0.016) * 0.016 - t; }

TEST_F(Clock, RemovesTheJitterOfAUart) {
  std::mt19937 random(3);
  std::exponential_distribution<double> delay(1 / 0.3e-3);
  line.true_rate_hz = 200.01;
  line.delay_s = [&](int i) { return i % 1000 == 77 ? 0.006 : delay(random); };
  const auto samples = run(clock, description, line, 240 * 200);
  const auto [rms, worst] = stamp_error(samples, line.true_rate_hz);
  EXPECT_LT(rms, 5e-6);
  EXPECT_LT(worst, 20e-6);
  EXPECT_NEAR(clock.status().period_s, 1 / 200.01, 1e-6 * 0.005);
  EXPECT_EQ(clock.status().resets, 0u);
}

TEST_F(Clock, RemovesTheJitterOfAUsbAdapter) {
  line.true_rate_hz = 200.013;
  line.delay_s = [&](int i) { return batched(i / 200.013 + 0.0003); };
  const auto samples = run(clock, description, line, 240 * 200);
  const auto [rms, worst] = stamp_error(samples, line.true_rate_hz);
  EXPECT_LT(rms, 400e-6);
  EXPECT_LT(worst, 800e-6);
  EXPECT_EQ(clock.status().resets, 0u);
}

// yoos/kvh_1750_troubleshooting: an IMU on its internal clock ran at 962.4 Hz instead of 1000, and angles that were
// computed with the nominal rate were 3.9 % short.
TEST_F(Clock, ComputesRightRatesAt962HzInsteadOf1000) {
  description = loose_thousand_hz();
  clock = drivers::Clock(description);
  std::mt19937 random(3);
  std::exponential_distribution<double> delay(1 / 0.3e-3);
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
  EXPECT_NEAR(angle / time_s / kTrueRateDegPerH, 1, 1e-4);
  EXPECT_NEAR(clock.status().period_s * 962.4, 1, 1e-5);
  EXPECT_TRUE(clock.status().period_is_estimated);
}

TEST_F(Clock, KeepsThePeriodDuringAStall) {
  description = loose_thousand_hz();
  clock = drivers::Clock(description);
  line.true_rate_hz = 962.4;
  line.delay_s = [](int i) { return i >= 2000 && i < 2400 ? (2400 - i) / 962.4 : 0.0; };
  run(clock, description, line, 10'000);
  EXPECT_NEAR(clock.status().period_s * 962.4, 1, 1e-5);
  EXPECT_EQ(clock.status().resets, 0u);
}

TEST_F(Clock, ForgetsAnOldPeriod) {
  clock = drivers::Clock(description, {.switch_s = 20});
  // The device's clock gets faster by 1e-4 after a minute: 5 us less a frame.
  double measured_s = 0;
  std::optional<Sample> last;
  for (int i = 0; i < 40'000; ++i) {
    measured_s += i < 12'000 ? 1.0 / 200 : 1.0 / 200.02;
    DecodedMessage reading = reading_of(description, {}, i);
    reading.arrival_ns = kEpochNs + std::llround(1e9 * (measured_s + wire_s(*description)));
    last = pushed(clock, reading);
  }
  ASSERT_TRUE(last);
  EXPECT_NEAR(clock.status().period_s * 200.02, 1, 1e-9);
  EXPECT_NEAR(seconds(last->time_ns), measured_s, 2e-6);
}

TEST_F(Clock, RecoversFromAWrongFirstStamp) {
  for (const double wrong_s : {86'400.0, 0.3, -86'400.0, -0.3}) {
    clock = drivers::Clock(description);
    line.delay_s = [&](int i) { return i == 0 ? wrong_s : 0.0; };
    const auto samples = run(clock, description, line, 1000);
    EXPECT_NEAR(seconds(samples.back().time_ns), 999.0 / 200, 1e-5) << "first stamp wrong by " << wrong_s << " s";
    for (std::size_t i = 1; i < samples.size() && wrong_s < 1; ++i)
      ASSERT_GE(samples[i].time_ns, samples[i - 1].time_ns);
    EXPECT_EQ(clock.status().resets, wrong_s == 0.3 ? 0u : 1u) << "0.3: it waited to be read";
  }
}

// Earlier bug: an ordinary stream began with "the gyro's counter or a clock jumped".
TEST_F(Clock, NeverReturnsAnEarlierStamp) {
  line.delay_s = [](int i) { return i < 40 ? 0.3 : 0.0; };  // a backlog, read at once when the line was opened
  const auto samples = run(clock, description, line, 1000);
  for (std::size_t i = 1; i < samples.size(); ++i) ASSERT_GE(samples[i].time_ns, samples[i - 1].time_ns) << i;
  EXPECT_NEAR(seconds(samples.back().time_ns), 999.0 / 200, 1e-5);
  EXPECT_EQ(clock.status().resets, 0u);
}

TEST_F(Clock, DoesNotResetAfterAStall) {
  line.delay_s = [](int i) { return i >= 1000 && i < 1100 ? (1100 - i) / 200.0 : 0.0; };  // half a second, read at once
  const auto samples = run(clock, description, line, 2000);
  EXPECT_EQ(clock.status().resets, 0u);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_NEAR(seconds(samples[i].time_ns), static_cast<double>(i + 1) / 200, 1e-5);
  }
}

TEST_F(Clock, RestartsTheFitIfTheCounterRestarts) {
  Line before;
  before.first_counter = 30'000;
  run(clock, description, before, 1000);
  Line after;
  after.first_counter = static_cast<std::uint64_t>(65536 * 2 - 1400);  // frame 1400 has counter 0
  std::vector<Sample> samples;
  for (int i = 1400; i < 1800; ++i) {
    if (const auto s = pushed(clock, reading_of(description, after, i))) samples.push_back(*s);
  }
  EXPECT_EQ(clock.status().resets, 1u);
  EXPECT_EQ(clock.status().missing_frames, 0u);
  EXPECT_NEAR(seconds(samples.back().time_ns), 1799.0 / 200, 1e-5);
}

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
      .rate_deg_per_h = {kTrueRateDegPerH}, .interval_s = period_s, .temperature_degc = 25, .uhfo_v = 1};
  std::vector<std::uint8_t> frame, kept;
  std::vector<DecodedMessage> readings;
  std::vector<Sample> samples;
  const auto give = [&](std::vector<std::uint8_t>& bytes, double at_s) {
    decoder.feed(bytes, kEpochNs + std::llround(1e9 * at_s), readings);
    for (const DecodedMessage& reading : readings) {
      if (const auto sample = pushed(clock, reading)) samples.push_back(*sample);
    }
    readings.clear();
    bytes.clear();
  };
  const double end_s = 10 + stall.stall_s;
  for (int i = 0; i * period_s < end_s + 10; ++i) {
    const double measured_s = i * period_s;
    const double arrival_s = measured_s + wire_s(*description);
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
TEST_F(ClockStall, CountsEveryFrameLostByTheBuffer) {
  for (const char* name : {"kvh1750", "stim300", "dsp1760", "dsp3000"}) {
    description = test::shipped(name);
    clock = drivers::Clock(description);
    Stall stall;
    const auto samples = run(description, clock, stall);
    ASSERT_GT(stall.lost, 100u) << name;
    EXPECT_EQ(clock.status().missing_frames, stall.lost) << name;
    EXPECT_GT(clock.status().missing_by_arrival, stall.lost / 2) << name;
    EXPECT_LE(clock.status().missing_by_arrival, stall.lost) << name;
    EXPECT_EQ(clock.status().resets, 0u) << name;
    EXPECT_NEAR(seconds(samples.back().time_ns), stall.last_s, 1e-4) << name;
    std::uint64_t told = 0;
    for (const Sample& sample : samples) told += sample.missing_frames;
    EXPECT_EQ(told, stall.lost) << name;
  }
}

TEST_F(ClockStall, LosesNothingIfTheBufferIsLargeEnough) {
  for (const char* name : {"kvh1750", "stim300", "dsp1760", "dsp3000", "trplg"}) {
    description = test::shipped(name);
    clock = drivers::Clock(description);
    Stall stall{.buffer_bytes = 1 << 20};
    const auto samples = run(description, clock, stall);
    ASSERT_EQ(stall.lost, 0u);
    EXPECT_EQ(clock.status().missing_frames, 0u) << name;
    EXPECT_EQ(clock.status().resets, 0u) << name;
    EXPECT_NEAR(seconds(samples.back().time_ns), stall.last_s, 1e-4) << name;
  }
}

TEST_F(ClockStall, UsesOnlyACounterThatCannotWrap) {
  Stall stall;
  run(description, clock, stall);
  ASSERT_GT(stall.lost, 100u);
  EXPECT_EQ(clock.status().missing_frames, stall.lost);
  EXPECT_EQ(clock.status().missing_by_arrival, 0u);
}

TEST_F(ClockStall, CountsAtTheFirstFrameAfterAGap) {
  description = test::shipped("kvh1750");
  clock = drivers::Clock(description);
  Stall stall{.silent = true};
  const auto samples = run(description, clock, stall);
  EXPECT_EQ(clock.status().missing_frames, stall.lost);
  EXPECT_NEAR(static_cast<double>(clock.status().missing_by_arrival), static_cast<double>(stall.lost), 128);
  for (const Sample& sample : samples) {
    if (sample.missing_frames == 0) continue;
    EXPECT_NEAR(seconds(sample.time_ns), 15, 0.01);
  }
}

// From 25 s on the way is interrupted for 12 s; then the frames follow one by one, each in a chunk of its own.
TEST_F(ClockStall, FramesThatWaitedOnTheWayKeepTheirDeviceTime) {
  clock = drivers::Clock(description, {.source = drivers::ClockSource::kDevice});
  line.delay_s = [](int i) { return i < 5000 ? 0 : std::max(0.0, 37 - i / 200.0 + 1e-4 * (i - 5000)); };
  const auto samples = run(clock, description, line, 10'000);
  EXPECT_EQ(clock.status().resets, 0u);
  EXPECT_LE(clock.status().missing_frames, 25u) << "0.1 s until it is seen that they waited";
  EXPECT_EQ(samples.size() + clock.status().missing_frames, 9999u);
  for (const Sample& sample : samples) {
    const double frame = 200 * seconds(sample.time_ns);
    ASSERT_NEAR(frame, std::round(frame), 1e-3);
  }
  EXPECT_NEAR(seconds(samples.back().time_ns), 9999 / 200.0, 1e-6);
}

// The device itself pauses for 12 s and continues with the next count.
TEST_F(ClockStall, ADevicePausedForLongBeginsASession) {
  clock = drivers::Clock(description, {.source = drivers::ClockSource::kDevice});
  line.delay_s = [](int i) { return i < 5000 ? 0.0 : 12.0; };
  for (const Sample& sample : run(clock, description, line, 10'000)) {
    const double at = seconds(sample.time_ns);
    ASSERT_TRUE(at < 25 || at > 37) << at;
  }
  EXPECT_EQ(clock.status().resets, 1u);
}

}  // namespace
}  // namespace prism::wire
