// SPDX-License-Identifier: MIT
// Decoder and clock recover what the simulated gyro sends: rate, temperature, voltage, faults.
#include "tools/prismsim/simulation/simulated_line.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "drivers/clock.hpp"
#include "drivers/wire/decode/frame_decoder.hpp"
#include "tests/support/shared_files.hpp"

namespace prism::simulation {
namespace {

wire::FrameDescriptionPtr trplg() {
  const std::string path = std::string(PRISM_SOURCE_DIR) + "/config/frames/trplg.json";
  auto description = wire::parse_frame_description(test::read_file(path), path);
  EXPECT_TRUE(description) << description.error().text();
  return *description;
}

// Frames through decoder and device clock; arrival is the interval's end.
struct Received {
  std::vector<Sample> samples;
  wire::DecoderCounters decoder;
  drivers::ClockStatus clock;
  SimulationCounters sent;
};

Received receive(const SimulationSettings& settings, int frames) {
  const wire::FrameDescriptionPtr description = trplg();
  SimulatedLine line(description, settings);
  wire::FrameDecoder decoder(description);
  drivers::ClockSettings device;
  device.source = drivers::ClockSource::kDevice;
  drivers::Clock clock(description, device);
  Received received;
  std::vector<std::uint8_t> bytes;
  std::vector<wire::DecodedMessage> readings;
  for (int i = 0; i < frames; ++i) {
    bytes.clear();
    readings.clear();
    line.next_frame(bytes);
    decoder.feed(bytes, line.time_ns(), readings);
    for (const wire::DecodedMessage& reading : readings) {
      if (!clock.push(reading)) continue;
      if (const auto sample = clock.sample(reading, 0)) received.samples.push_back(*sample);
    }
  }
  received.decoder = decoder.counters();
  received.clock = clock.status();
  received.sent = line.counters();
  return received;
}

struct SimulatedLineTest : testing::Test {
  SimulationSettings settings;
};

TEST_F(SimulatedLineTest, TransmitsTheTruth) {
  settings.earth_rate_deg_per_h = {8.4652};
  const int seconds = 3000;
  const Received received = receive(settings, 200 * seconds);
  ASSERT_EQ(received.samples.size(), static_cast<std::size_t>(200 * seconds - 1));
  EXPECT_EQ(received.decoder.skipped_bytes, 0u);
  EXPECT_EQ(received.clock.missing_frames, 0u);
  SimulatedGyro gyro(settings.profile, settings.seed);
  double bias = 0, angle_arcsec = 0, time_s = 0;
  for (int s = 0; s < seconds; ++s) bias += gyro.step(1).bias_deg_per_h / seconds;
  for (const Sample& sample : received.samples) {
    angle_arcsec += sample.rate_deg_per_h * sample.interval_s;
    time_s += sample.interval_s;
  }
  // 0.064 deg/h √s of white noise over 3000 s: 0.0012 deg/h; four of those
  EXPECT_NEAR(angle_arcsec / time_s, 8.4652 + bias, 0.0047);
  EXPECT_NEAR(received.samples.back().temperature_degc, gyro.truth().body_degc, 1e-4);
  EXPECT_NEAR(received.samples.back().uhfo_v, gyro.truth().uhfo_v, 1e-6);
  EXPECT_NEAR(received.samples.back().interval_s, 0.005, 1e-12);
}

// 40 means of 100 s in a steady chamber: their scatter is 0.0064 deg/h, known to 11 %; three of those.
TEST_F(SimulatedLineTest, HasTheNoiseOfThePapersGyro) {
  settings.profile = steady_profile();
  settings.rate_hz = 200;
  const int blocks = 40, per_block = 20000;
  const Received received = receive(settings, blocks * per_block + 1);
  SimulatedGyro gyro(settings.profile, settings.seed);
  double squares = 0;
  for (int k = 0; k < blocks; ++k) {
    double rate = 0, bias = 0;
    for (int i = 0; i < per_block; ++i)
      rate += received.samples[static_cast<std::size_t>(k) * per_block + static_cast<std::size_t>(i)].rate_deg_per_h /
              per_block;
    for (int s = 0; s < 100; ++s) bias += gyro.step(1).bias_deg_per_h / 100;
    squares += (rate - bias) * (rate - bias) / blocks;
  }
  EXPECT_NEAR(std::sqrt(squares), 0.0064, 0.0022);
}

TEST_F(SimulatedLineTest, LosesFramesThatTheCounterShows) {
  settings.lose_frames = 0.01;
  const Received received = receive(settings, 50000);
  EXPECT_GT(received.sent.lost_frames, 400u);
  EXPECT_LT(received.sent.lost_frames, 600u);
  EXPECT_EQ(received.decoder.frames, 50000 - received.sent.lost_frames);
  EXPECT_EQ(received.decoder.skipped_bytes, 0u);
  EXPECT_EQ(received.clock.missing_frames, received.sent.lost_frames);
}

TEST_F(SimulatedLineTest, CountsDamagedAndDroppedBytes) {
  settings.damage_bytes = 1e-3;
  settings.drop_bytes = 5e-4;
  const Received received = receive(settings, 50000);  // a million bytes
  EXPECT_NEAR(static_cast<double>(received.sent.damaged_bytes), 1000, 130);
  EXPECT_NEAR(static_cast<double>(received.sent.dropped_bytes), 500, 90);
  EXPECT_EQ(received.decoder.bytes, 50000u * 20 - received.sent.dropped_bytes);
  const std::uint64_t faults = received.sent.damaged_bytes + received.sent.dropped_bytes;
  EXPECT_GE(received.decoder.frames, 50000 - faults);
  EXPECT_LE(received.decoder.frames, 50000 - faults * 9 / 10);  // few frames are hit twice
}

TEST_F(SimulatedLineTest, CountsItsOutliers) {
  SimulationSettings quiet, jumpy;
  jumpy.outliers_per_h = 720;  // 1000 s: about 200
  const Received a = receive(quiet, 200000), b = receive(jumpy, 200000);
  EXPECT_NEAR(static_cast<double>(b.sent.outliers), 200, 57);
  std::size_t apart = 0;
  ASSERT_EQ(a.samples.size(), b.samples.size());
  for (std::size_t i = 0; i < a.samples.size(); ++i) {
    const double jump_arcsec = std::abs(b.samples[i].rate_deg_per_h - a.samples[i].rate_deg_per_h) * 0.005;
    if (jump_arcsec < 1) continue;
    ++apart;
    EXPECT_GE(jump_arcsec, 1.8);  // 2 to 10 arcsec, in pulses of 0.1
    EXPECT_LE(jump_arcsec, 10.2);
  }
  EXPECT_EQ(apart, b.sent.outliers);
}

TEST_F(SimulatedLineTest, SameSeedGivesTheSameBytes) {
  settings.drop_bytes = 1e-3;
  settings.lose_frames = 1e-3;
  const wire::FrameDescriptionPtr description = trplg();
  const auto bytes = [&](std::uint64_t seed) {
    settings.seed = seed;
    SimulatedLine line(description, settings);
    std::vector<std::uint8_t> out;
    for (int i = 0; i < 5000; ++i) line.next_frame(out);
    return out;
  };
  EXPECT_EQ(bytes(1), bytes(1));
  EXPECT_NE(bytes(1), bytes(2));
}

// A third of a second is not an integer of nanoseconds; after a day the frame time is still exact.
TEST_F(SimulatedLineTest, FramesDoNotDrift) {
  settings.profile = steady_profile();
  settings.rate_hz = 3;
  SimulatedLine line(trplg(), settings);
  std::vector<std::uint8_t> out;
  for (int i = 0; i < 3 * 86400; ++i) {
    out.clear();
    line.next_frame(out);
  }
  EXPECT_EQ(line.time_ns(), 86'400'000'000'000);
  EXPECT_NEAR(line.truth().time_s, 86400, 1e-6);
}

}  // namespace
}  // namespace prism::simulation
