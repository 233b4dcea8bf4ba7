// SPDX-License-Identifier: MIT
// A model of gyro and line for the tests of the clock: times of measurement and arrival.
#pragma once

#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "drivers/clock.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::test {

inline constexpr std::int64_t kEpochNs = 1'700'000'000'000'000'000;
inline constexpr double kRateDegPerH = 8.4652;

/// Frames of a gyro and their arrival times: the truth of these tests.
struct Line {
  double true_rate_hz = 200;
  double nominal_rate_hz = 200;
  std::function<double(int)> delay_s = [](int) { return 0.0; };
  std::function<bool(int)> lost = [](int) { return false; };
  std::uint64_t first_counter = 0;
};

inline double wire_s(const wire::FrameDescription& description) {
  return 1e-9 * description.wire.byte_time_ns() * description.max_frame_bytes;
}

/// Frame i is measured at i / true_rate and arrives one wire time and its delay later.
inline wire::DecodedMessage reading_of(const wire::FrameDescriptionPtr& description, const Line& line, int i) {
  const double measured_s = i / line.true_rate_hz;
  wire::DecodedMessage reading;
  reading.length = description->max_frame_bytes;
  reading.offset = static_cast<std::uint64_t>(i) * reading.length;
  reading.arrival_ns = kEpochNs + std::llround(1e9 * (measured_s + wire_s(*description) + line.delay_s(i)));
  reading.has_gyro = reading.has_counter = reading.gyro[0].carried = reading.gyro[0].valid = true;
  reading.counter = (line.first_counter + static_cast<std::uint64_t>(i)) % description->counter->modulus;
  const double pulses = std::floor(kRateDegPerH * measured_s / description->axes[0].scale);
  reading.gyro[0].value = std::fmod(pulses, 4294967296.0);
  reading.temperature_degc = 25;
  return reading;
}

/// The sample of the first axis.
inline std::optional<Sample> pushed(drivers::Clock& clock, const wire::DecodedMessage& reading) {
  return clock.push(reading) ? clock.sample(reading, 0) : std::nullopt;
}

inline std::vector<Sample> run(drivers::Clock& clock, const wire::FrameDescriptionPtr& description, const Line& line,
                               int frames) {
  std::vector<Sample> samples;
  for (int i = 0; i < frames; ++i) {
    if (line.lost(i)) continue;
    if (const auto sample = test::pushed(clock, reading_of(description, line, i))) samples.push_back(*sample);
  }
  return samples;
}

inline double seconds(std::int64_t time_ns) { return 1e-9 * static_cast<double>(time_ns - kEpochNs); }

/// trplg at another nominal rate, from a device whose clock has an error up to 5 %.
inline wire::FrameDescriptionPtr loose_thousand_hz() {
  std::string text = read_file(frames_dir() / "trplg.json");
  text.replace(text.find("\"rate_hz\": 200"), 14, "\"rate_hz\": 1000");
  text.replace(text.find("\"rate_tolerance\": "), 24, "\"rate_tolerance\": 0.05,");
  return description_of(text);
}

// yoos/kvh_1750_troubleshooting: an IMU on its internal clock ran at 962.4 Hz instead of 1000, and angles that were
// computed with the nominal rate were 3.9 % short.
}  // namespace prism::test
