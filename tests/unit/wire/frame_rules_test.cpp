// SPDX-License-Identifier: MIT
// The rules that recognise a frame, one by one, with frames that each rejects.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "drivers/wire/decode/inspect.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes text(const std::string& line) { return {line.begin(), line.end()}; }

bool decodes(const FrameDescriptionPtr& description, const Bytes& bytes) {
  return inspect_frame(*description, bytes).has_value();
}

TEST(FrameRules, RejectAnIncompleteFirstLine) {
  const auto readings =
      test::decode(test::shipped("dsp3000-ascii"),
                   text("15.015733    1\r\n    0.015733   1\r\n    0.015734   1\r\n    0.015735   1\r\n"));
  ASSERT_EQ(readings.size(), 3u);
  EXPECT_EQ(readings[0].gyro[0].value, 0.015733) << "not the rest of -115.015733";
}

// The ASCII output of the DSP-3000 has no checksum: a line that lost a decimal was accepted as another rate.
TEST(FrameRules, RejectALineThatLostACharacter) {
  const auto description = test::shipped("dsp3000-ascii");
  const std::string good = "    -123.456789   1\r\n";
  const std::size_t point = good.find('.'), sign = good.find('-');
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string line = good;
    line.erase(at, 1);
    for (const DecodedMessage& reading :
         test::decode(description, text(std::string(good).append(line).append(good).append(good)))) {
      const bool seen = at < sign || at >= point;  // the manual states no width: a sign or a first digit may be missing
      if (seen && reading.gyro[0].valid) {
        EXPECT_EQ(reading.gyro[0].value, -123.456789) << "without character " << at;
      }
    }
  }
}

TEST(FrameRules, RejectFillerWithAValidChecksum) {
  const auto hg = test::shipped("hg4930");
  Bytes frame = {0x0E, 0x01, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55,
                 0x55, 0x55, 0x55, 0x55, 0x01, 0x00, 0x05, 0x02, 0x12, 0x04};
  unsigned sum = 0;
  for (std::size_t i = 0; i < 18; i += 2) sum += frame[i] + 256u * frame[i + 1];
  frame[18] = static_cast<std::uint8_t>(sum);
  frame[19] = static_cast<std::uint8_t>(sum >> 8);
  EXPECT_FALSE(decodes(hg, frame));
  frame[17] = 0x00;  // data have started
  sum -= 0x0200;
  frame[18] = static_cast<std::uint8_t>(sum);
  frame[19] = static_cast<std::uint8_t>(sum >> 8);
  EXPECT_TRUE(decodes(hg, frame));
}

TEST(FrameRules, TestTheHeaderCheckBeforeUsingTheLength) {
  // ANPP: an invalid header must not make the decoder wait for its 260 bytes.
  FrameDecoder decoder(test::shipped("kvh-geo-fog"));
  std::vector<DecodedMessage> out;
  const Bytes noise = {0x00, 0x07, 0xFF, 0x12, 0x34};  // length 255, header sum wrong
  decoder.feed(noise, 0, out);
  EXPECT_EQ(decoder.counters().bad_check, 1u);
  EXPECT_LT(decoder.held_bytes(), 5u);
}

TEST(FrameRules, HoldTheFirstWeakFrameUntilASecond) {
  const auto description = test::shipped("xor7-10");
  FrameEncoder encoder(description);
  Bytes bytes;
  for (int i = 0; i < 3; ++i)
    encoder.encode({.rate_deg_per_h = {10}, .interval_s = 1e-3, .temperature_degc = 20}, bytes);
  FrameDecoder decoder(description);
  std::vector<DecodedMessage> out;
  decoder.feed(std::span(bytes).first(10), 0, out);
  EXPECT_TRUE(out.empty()) << "14 bits of check may be chance";
  decoder.feed(std::span(bytes).subspan(10, 10), 1'000'000, out);
  ASSERT_EQ(out.size(), 2u);
  EXPECT_EQ(out[0].arrival_ns, 0) << "held back, but stamped when it came";
  decoder.feed(std::span(bytes).subspan(20), 2'000'000, out);
  EXPECT_EQ(out.size(), 3u) << "and now each one at once";
}

TEST(FrameRules, RejectAWeakFrameWithoutASecond) {
  const auto description = test::shipped("xor7-10");
  FrameEncoder encoder(description);
  Bytes bytes;
  encoder.encode({.rate_deg_per_h = {10}, .interval_s = 1e-3, .temperature_degc = 20}, bytes);
  bytes.resize(40, 0x55);
  EXPECT_TRUE(test::decode(description, bytes).empty());
}

TEST(FrameRules, ConfirmWordsWithoutSyncAfterEveryBreak) {
  const auto description = test::shipped("dsp3000");
  FrameEncoder encoder(description);
  Bytes bytes;
  for (int i = 0; i < 100; ++i) encoder.encode({.rate_deg_per_h = {1000.0 + i}, .interval_s = 1e-3}, bytes);
  const std::size_t good = bytes.size();
  std::mt19937 random(6);
  for (int i = 0; i < 2000; ++i) bytes.push_back(static_cast<std::uint8_t>(random()));
  const auto readings = test::decode(description, bytes);
  const auto in_garbage =
      std::count_if(readings.begin(), readings.end(), [&](const DecodedMessage& r) { return r.offset >= good; });
  EXPECT_EQ(readings.size() - static_cast<std::size_t>(in_garbage), 100u);
  EXPECT_LE(in_garbage, 3) << "a word or two that happen to fit at the end of the good ones";
}

TEST(FrameRules, ConfirmWeakFramesOnlyWithTheRightCounterStep) {
  const auto description = test::shipped("stim210");
  FrameEncoder encoder(description);
  const GyroState state{.rate_deg_per_h = {10}, .interval_s = 1e-3, .temperature_degc = 20};
  Bytes bytes;
  encoder.encode(state, bytes);
  encoder.skip(state, 5);
  encoder.encode(state, bytes);
  EXPECT_TRUE(test::decode(description, bytes).empty()) << "two with six steps between them";
  encoder.encode(state, bytes);
  EXPECT_EQ(test::decode(description, bytes).size(), 2u) << "the second and third confirm each other";
}

/// Frames of a description with halves of a temperature: counter, 1 (high), 2 (low) or 0 (neither), the half.
Bytes half_frames(const std::vector<std::array<std::uint8_t, 3>>& frames) {
  const Crc crc({16, 0x1021, 0, false, false, 0});
  Bytes bytes;
  for (const auto& [counter, which, half] : frames) {
    const Bytes frame = {0xAB, 0xCD, counter, which, half};
    const auto check = crc.compute(frame);
    bytes.insert(bytes.end(), frame.begin(), frame.end());
    bytes.push_back(static_cast<std::uint8_t>(check >> 8));
    bytes.push_back(static_cast<std::uint8_t>(check));
  }
  return bytes;
}

FrameDescriptionPtr halves_description(const std::string& counter) {
  return test::description_of(
      R"({"format": "prism-frames", "version": 1, "name": "x", "line": {"baud": 921600}, "rate_hz": 100,
    "kinds": [{"name": "k", "sync": {"bytes": "AB CD"}, "length": 7, "checks": {"kind": "crc", "width": 16, "poly": "0x1021", "to": -2, "at": -2},
      "fields": {"n": {"at": 2, "type": "u8"}, "which": {"at": 3, "type": "u8"},
                 "high": {"at": 4, "type": "u8", "when": {"field": "which", "values": 1}},
                 "low": {"at": 4, "type": "u8", "when": {"field": "which", "values": 2}}}}],
    "gyro": {"meaning": "rate", "unit": "deg/h", "axes": {"z": "n"}}, "counter": )" +
      counter + R"(,
    "temperature": {"high": "high", "low": "low", "stale_after_s": 0.05}})");
}

TEST(FrameRules, AgeASlowChannelByCountedFrames) {
  // 600 counted frames a second, of which 100 have gyro data: 50 ms are 30 of them.
  const auto description = halves_description(R"({"field": "n", "ticks_per_s": 600, "step": 1})");
  std::vector<std::array<std::uint8_t, 3>> frames = {{0, 1, 1}, {1, 2, 2}};
  for (std::uint8_t n = 2; n < 40; ++n) frames.push_back({n, 0, 0});
  const auto readings = test::decode(description, half_frames(frames));
  ASSERT_EQ(readings.size(), 40u);
  EXPECT_EQ(readings[31].temperature_degc, 258);
  EXPECT_TRUE(std::isnan(readings[32].temperature_degc));
}

TEST(FrameRules, KeepASlowChannelUntilItsLimitInOneSession) {
  const auto description = test::shipped("fizoptika");
  FrameEncoder encoder(description);
  FrameDecoder decoder(description);
  std::vector<DecodedMessage> out;
  const auto send = [&](int frames) {
    Bytes bytes;
    for (int i = 0; i < frames; ++i)
      encoder.encode({.rate_deg_per_h = {10}, .interval_s = 1e-3, .temperature_degc = 30, .uhfo_v = 5}, bytes);
    decoder.feed(bytes, 0, out);
  };
  send(48);
  EXPECT_NEAR(out.back().temperature_degc, 30, 0.01);
  decoder.reset();
  send(1);
  EXPECT_TRUE(std::isnan(out.back().temperature_degc)) << "of the session before";
}

}  // namespace
}  // namespace prism::wire
