// SPDX-License-Identifier: MIT
// The encoder behaves like the device: it loses only those parts of an angle that a real line loses.
#include "drivers/wire/encode/frame_encoder.hpp"

#include <gtest/gtest.h>

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

TEST(FrameEncoder, LosesUnsentIncrementsButNoAccumulatedAngle) {
  for (const bool accumulated : {false, true}) {
    const auto description = test::shipped(accumulated ? "trplg" : "trplg-increment");
    FrameEncoder encoder(description);
    Bytes bytes;
    encoder.encode(kEarth, bytes);
    encoder.skip(kEarth, 2000);
    encoder.encode(kEarth, bytes);
    const auto readings = test::decode(description, bytes);
    ASSERT_EQ(readings.size(), 2u);
    EXPECT_EQ((readings[1].counter - readings[0].counter) & 0xFFFF, 2001u);
    if (accumulated) {
      EXPECT_NEAR(0.1 * (readings[1].gyro[0].value - readings[0].gyro[0].value), 8.4652 * 2001 * 0.005, 0.1);
    } else {
      EXPECT_LE(readings[1].gyro[0].value, 1);
    }
  }
}

TEST(FrameEncoder, AccumulatedAnglePassesZeroBackwards) {
  const auto description = test::shipped("trplg");
  FrameEncoder encoder(description);
  GyroState state = kEarth;
  state.rate_deg_per_h = {-72'000};  // 3600 pulses a frame
  Bytes bytes;
  for (int i = 0; i < 3; ++i) encoder.encode(state, bytes);
  const auto readings = test::decode(description, bytes);
  ASSERT_EQ(readings.size(), 3u);
  EXPECT_EQ(readings[0].gyro[0].value, 4294967296.0 - 3600);
  EXPECT_EQ(readings[2].gyro[0].value, 4294967296.0 - 3 * 3600);
}

TEST(FrameEncoder, LimitsValuesToTheFieldsRange) {
  const auto description = test::shipped("trplg");
  FrameEncoder encoder(description);
  GyroState state = kEarth;
  state.uhfo_v = 99;
  Bytes bytes;
  encoder.encode(state, bytes);
  EXPECT_EQ(bytes[13], 0xFF);
  EXPECT_EQ(bytes[14], 0xFF);
  EXPECT_EQ(bytes[15], 0xFF);
}

TEST(FrameEncoder, SendsTheMessageTypesInTurn) {
  const auto description = test::shipped("hg4930");
  FrameEncoder encoder(description);
  Bytes bytes;
  for (int i = 0; i < 12; ++i) encoder.encode(kEarth, bytes);
  std::string ids;
  for (const DecodedMessage& reading : test::decode(description, bytes)) ids += reading.has_gyro ? 'i' : 'c';
  EXPECT_EQ(ids, "ccccciccccci");
}

}  // namespace
}  // namespace prism::wire
