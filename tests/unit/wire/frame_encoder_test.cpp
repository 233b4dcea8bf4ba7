// SPDX-License-Identifier: MIT
// The encoder behaves like the device: it loses only those parts of an angle that a real line loses.
#include "drivers/wire/encode/frame_encoder.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr GyroState kEarth{.rate_deg_per_h = {8.4652}, .interval_s = 0.005, .temperature_degc = 25, .uhfo_v = 5.3};

TEST(FrameEncoder, KeepsTheRemainderBelowOnePulse) {
  const auto description = test::shipped("trplg-increment");
  FrameEncoder encoder(description);
  Bytes bytes;
  for (int i = 0; i < 20'000; ++i) encoder.encode(kEarth, bytes);
  double pulses = 0;
  for (const DecodedMessage& reading : test::decode(description, bytes)) pulses += reading.gyro[0].value;
  EXPECT_NEAR(pulses * 0.1, 8.4652 * 100, 0.1) << "0.42 pulses a frame";
}

TEST(FrameEncoder, EachFrameHasItsOwnStatusAndValidity) {
  constexpr std::uint32_t kBit = 0x40;
  std::vector<GyroState> states(8, kEarth);
  states[1].valid[0] = states[2].valid[0] = states[5].valid[0] = false;
  states[2].status = states[3].status = states[6].status = kBit;
  states[4].temperature_degc = states[5].temperature_degc = kUnknown;
  for (const char* name : {"dsp1760", "second-means"}) {
    const auto description = test::shipped(name);
    const bool has_status = description->name == "dsp1760";
    FrameEncoder encoder(description);
    Bytes bytes;
    for (const GyroState& state : states) {
      EXPECT_EQ(encoder.can_state(state), !has_status || std::isfinite(state.temperature_degc));
      encoder.encode(state, bytes);
    }
    const auto readings = test::decode(description, bytes);
    ASSERT_EQ(readings.size(), states.size());
    for (std::size_t i = 0; i < states.size(); ++i) {
      EXPECT_EQ(readings[i].gyro[0].valid, states[i].valid[0]) << name << ", " << i;
      if (has_status)
        EXPECT_EQ(readings[i].status & kBit, states[i].status) << i;
      else
        EXPECT_EQ(std::isnan(readings[i].temperature_degc), std::isnan(states[i].temperature_degc)) << i;
    }
  }
}

TEST(FrameEncoder, WritesAnAngleInTheRangeOfItsField) {
  Field field;
  field.type = NumberType::kFloat32;
  for (const auto& [min, raw] : {std::pair{-180.0, -90.0}, {0.0, 270.0}}) {
    field.scaling.min = min;
    for (const double angle : {-450.0, -90.0, 270.0})
      EXPECT_EQ(raw_number(field, angle, 360), raw) << min << " " << angle;
  }
}

// A temperature in two halves is held at the ends of its bits; one that is not known is 0.
TEST(FrameEncoder, HoldsJoinedHalvesWithinTheirBits) {
  for (const bool is_signed : {true, false}) {
    const auto description = parse_frame_description(
        fmt::format(
            R"({{"format": "prism-frames", "version": 1, "name": "halves", "line": {{"baud": 9600}}, "rate_hz": 10,
          "kinds": [{{"name": "k", "sync": {{"bytes": "AB CD"}}, "length": 9,
                     "checks": {{"kind": "crc", "width": 16, "poly": "0x1021", "to": -2, "at": -2}},
                     "fields": {{"rate": {{"at": 2, "type": "s24"}}, "high": {{"at": 5, "type": "u8"}}, "low": {{"at": 6, "type": "u8"}}}}}}],
          "gyro": {{"meaning": "rate", "unit": "deg/h", "axes": {{"z": "rate"}}}},
          "temperature": {{"high": "high", "low": "low", "low_bits": 8, "bits": 16, "signed": {}, "scale": 0.01}}}})",
            is_signed),
        "f.json");
    ASSERT_TRUE(description) << description.error().text();
    const auto halves = [&](double degc) {
      FrameEncoder encoder(*description);
      Bytes bytes;
      GyroState state{.rate_deg_per_h = {1}, .interval_s = 0.1, .temperature_degc = degc};
      EXPECT_EQ(encoder.can_state(state), std::isfinite(degc));
      encoder.encode(state, bytes);
      state.valid[0] = false;
      EXPECT_FALSE(encoder.can_state(state)) << "no bit marks the rate";
      return 256 * bytes.at(5) + bytes.at(6);
    };
    EXPECT_EQ(halves(25.37), 2537);
    EXPECT_EQ(halves(1e3), is_signed ? 0x7FFF : 0xFFFF);
    EXPECT_EQ(halves(-0.01), is_signed ? 0xFFFF : 0);
    EXPECT_EQ(halves(-1e3), is_signed ? 0x8000 : 0);
    EXPECT_EQ(halves(kUnknown), 0);
  }
}

}  // namespace
}  // namespace prism::wire
