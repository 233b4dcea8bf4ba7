// SPDX-License-Identifier: MIT
// The encoder behaves like the device: it loses only those parts of an angle that a real line loses.
#include "drivers/wire/encode/frame_encoder.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
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
    for (const GyroState& state : states) encoder.encode(state, bytes);
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

}  // namespace
}  // namespace prism::wire
