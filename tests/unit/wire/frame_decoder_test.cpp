// SPDX-License-Identifier: MIT
// Guarantees of the decoder with the project's own frame: any chunks, damage and garbage.
#include "drivers/wire/decode/frame_decoder.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes frames_of(const FrameDescriptionPtr& description, int count) {
  FrameEncoder encoder(description);
  Bytes out;
  for (int i = 0; i < count; ++i) {
    encoder.encode(
        {.rate_deg_per_h = {8.4652 + i}, .interval_s = 0.005, .temperature_degc = 25 + 0.01 * i, .uhfo_v = 5.3}, out);
  }
  return out;
}

bool same(const DecodedMessage& a, const DecodedMessage& b) {
  return a.offset == b.offset && a.length == b.length && a.kind == b.kind && a.counter == b.counter &&
         a.gyro[0].value == b.gyro[0].value && a.temperature_degc == b.temperature_degc && a.uhfo_v == b.uhfo_v &&
         a.status == b.status && a.gyro[0].valid == b.gyro[0].valid;
}

std::vector<DecodedMessage> decode_in_chunks(const FrameDescriptionPtr& description, const Bytes& bytes, unsigned seed,
                                             int longest) {
  std::mt19937 random(seed);
  FrameDecoder decoder(description);
  std::vector<DecodedMessage> out;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t size = std::min<std::size_t>(bytes.size() - at, 1 + random() % static_cast<unsigned>(longest));
    at += size;
    decoder.feed({bytes.data() + at - size, size}, static_cast<std::int64_t>(1e3 * static_cast<double>(at)), out);
  }
  decoder.finish(out);
  return out;
}

Bytes garbage(std::size_t size, unsigned seed) {
  std::mt19937 random(seed);
  Bytes bytes(size);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
  return bytes;
}

TEST(FrameDecoder, DecodesTheWorkedExample) {
  const auto description = test::shipped("trplg");
  const auto readings = test::decode(description, description->test_vectors[0].bytes);
  ASSERT_EQ(readings.size(), 1u);
  EXPECT_EQ(readings[0].counter, 0x1234u);
  EXPECT_EQ(readings[0].gyro[0].value, 1000000);
  EXPECT_NEAR(readings[0].temperature_degc, 25, 1e-4);
  EXPECT_DOUBLE_EQ(readings[0].uhfo_v, 5.32);
  EXPECT_EQ(readings[0].status, 7u);
  EXPECT_TRUE(readings[0].gyro[0].valid);
}

TEST(FrameDecoder, ReturnsTheSameReadingsForAnyChunks) {
  const auto description = test::shipped("trplg");
  Bytes bytes = frames_of(description, 200);
  std::mt19937 random(5);
  for (int i = 0; i < 20; ++i) bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1 + random() % 255);
  const auto whole = test::decode(description, bytes);
  ASSERT_GT(whole.size(), 170u);
  for (unsigned seed = 0; seed < 40; ++seed) {
    const auto cut = decode_in_chunks(description, bytes, seed, 1 + static_cast<int>(seed) * 2);
    ASSERT_EQ(cut.size(), whole.size()) << "seed " << seed;
    for (std::size_t i = 0; i < cut.size(); ++i)
      ASSERT_TRUE(same(cut[i], whole[i])) << "seed " << seed << " frame " << i;
  }
}

TEST(FrameDecoder, LosesOnlyADamagedFrame) {
  const auto description = test::shipped("trplg");
  const Bytes good = frames_of(description, 5);
  for (std::size_t at = 0; at < 20; ++at) {
    Bytes bytes = good;
    bytes[40 + at] ^= 0x10;
    const auto readings = test::decode(description, bytes);
    ASSERT_EQ(readings.size(), 4u) << "damaged byte " << at;
    EXPECT_EQ(readings[2].offset, 60u);
  }
}

TEST(FrameDecoder, FindsAGoodFrameInsideABadOne) {
  const auto description = test::shipped("trplg");
  const Bytes good = frames_of(description, 2);
  Bytes bytes(good.begin(), good.begin() + 7);  // a frame whose rest was dropped: the next one begins inside it
  bytes.insert(bytes.end(), good.begin() + 20, good.end());
  const auto readings = test::decode(description, bytes);
  ASSERT_EQ(readings.size(), 1u);
  EXPECT_EQ(readings[0].offset, 7u);
}

TEST(FrameDecoder, ReturnsNothingForGarbageAndBoundsItsMemory) {
  FrameDecoder decoder(test::shipped("trplg"));
  std::vector<DecodedMessage> out;
  for (unsigned i = 0; i < 200; ++i) decoder.feed(garbage(5000, i), i, out);
  decoder.finish(out);
  EXPECT_TRUE(out.empty());
  EXPECT_FALSE(decoder.waiting());
  EXPECT_EQ(decoder.counters().skipped_bytes, 1'000'000u);
  EXPECT_EQ(decoder.counters().bytes, 1'000'000u);
}

TEST(FrameDecoder, CountsOneResyncPerDamage) {
  const auto description = test::shipped("trplg");
  Bytes bytes = frames_of(description, 10);
  bytes[45] ^= 1;
  FrameDecoder decoder(description);
  std::vector<DecodedMessage> out;
  decoder.feed(bytes, 0, out);
  EXPECT_EQ(decoder.counters().resyncs, 1u);
  EXPECT_EQ(decoder.counters().bad_check, 1u);
  EXPECT_EQ(decoder.counters().skipped_bytes, 20u);
  EXPECT_EQ(decoder.counters().frames, 9u);
}

TEST(FrameDecoder, UsesTheArrivalOfTheLastByteOfTheFrame) {
  const auto description = test::shipped("trplg");
  const Bytes bytes = frames_of(description, 2);
  FrameDecoder decoder(description);
  std::vector<DecodedMessage> out;
  decoder.feed(std::span(bytes).first(30), 1'000'000'000, out);
  decoder.feed(std::span(bytes).subspan(30), 1'000'200'000, out);
  ASSERT_EQ(out.size(), 2u);
  EXPECT_EQ(out[0].arrival_ns, 1'000'000'000 - std::llround(10 * 1e10 / 921600));
  EXPECT_EQ(out[1].arrival_ns, 1'000'200'000);
}

TEST(FrameDecoder, KeepsAFrameSplitByALongGap) {
  const auto description = test::shipped("trplg");
  const Bytes bytes = frames_of(description, 1);
  FrameDecoder decoder(description);
  std::vector<DecodedMessage> out;
  decoder.feed(std::span(bytes).first(12), 0, out);
  decoder.expire(500'000'000, out);
  decoder.feed(std::span(bytes).subspan(12), 1'000'000'000, out);
  EXPECT_EQ(out.size(), 1u);
  EXPECT_EQ(decoder.counters().timeouts, 0u);
}

// A message type with a length field: damage can make the decoder wait for bytes that never come.
constexpr const char* kLengthInFrame = R"({
  "format": "prism-frames", "version": 1, "name": "x", "line": {"baud": 115200}, "rate_hz": 10,
  "kinds": [{"name": "k", "sync": {"bytes": "AB"}, "length": {"at": 1, "type": "u8", "min": 6, "max": 255},
             "checks": {"kind": "crc", "width": 16, "poly": "0x1021", "to": -2, "at": -2},
             "fields": {"rate": {"at": 2, "type": "s16"}}}],
  "gyro": {"meaning": "rate", "unit": "deg/h", "axes": {"z": "rate"}}})";

TEST(FrameDecoder, ReturnsTheSameReadingsWithAndWithoutTimer) {
  const auto description = test::description_of(kLengthInFrame);
  Bytes bytes = frames_of(description, 4);
  bytes[1] = 200;  // the first frame now seems to contain the other three and more
  for (const bool timer : {false, true}) {
    FrameDecoder decoder(description);
    std::vector<DecodedMessage> out;
    decoder.feed(std::span(bytes).first(18), 0, out);
    EXPECT_TRUE(out.empty());
    if (timer) decoder.expire(100'000'000, out);
    EXPECT_EQ(out.size(), timer ? 2u : 0u) << "the timer makes them come sooner";
    decoder.feed(std::span(bytes).subspan(18), 200'000'000, out);
    ASSERT_EQ(out.size(), 3u);
    EXPECT_EQ(out[0].offset, 6u);
    EXPECT_LE(out[1].arrival_ns, 0) << "late does not mean a late stamp";
    EXPECT_EQ(decoder.counters().timeouts, 1u);
  }
}

TEST(FrameDecoder, WrongLengthDelaysFramesAtMostUntilItsEnd) {
  const auto description = test::description_of(kLengthInFrame);
  Bytes bytes = frames_of(description, 100);
  bytes[1] = 200;
  FrameDecoder decoder(description);
  std::vector<DecodedMessage> out;
  for (std::size_t i = 0; i < 200; ++i) decoder.feed({&bytes[i], 1}, static_cast<std::int64_t>(i) * 86'806, out);
  EXPECT_EQ(out.size(), 32u);
  EXPECT_EQ(out[0].arrival_ns, 11 * 86'806) << "stamped when its last byte came, not when it was found";
}

TEST(FrameDecoder, ResetForgetsHeldBytesAndSlowValues) {
  const auto description = test::shipped("trplg");
  const Bytes bytes = frames_of(description, 2);
  FrameDecoder decoder(description);
  std::vector<DecodedMessage> out;
  decoder.feed(std::span(bytes).first(15), 0, out);
  decoder.reset();
  decoder.feed(std::span(bytes).subspan(15), 1, out);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].offset, 20u);
  EXPECT_EQ(decoder.counters().skipped_bytes, 20u);
}

TEST(FrameDecoder, SensorMarkedInvalidIsUnknown) {
  const auto description = test::shipped("trplg");
  FrameEncoder encoder(description);
  Bytes bytes;
  encoder.encode({.rate_deg_per_h = {8}, .interval_s = 0.005, .temperature_degc = 20, .uhfo_v = 5.3}, bytes);
  encoder.encode(
      {.rate_deg_per_h = {8}, .interval_s = 0.005, .temperature_degc = kUnknown, .uhfo_v = 5.3, .valid = {false}},
      bytes);
  const auto readings = test::decode(description, bytes);
  ASSERT_EQ(readings.size(), 2u);
  EXPECT_NEAR(readings[0].temperature_degc, 20, 1e-4);
  EXPECT_TRUE(std::isnan(readings[1].temperature_degc));
  EXPECT_DOUBLE_EQ(readings[1].uhfo_v, 5.3);
  EXPECT_FALSE(readings[1].gyro[0].valid);
  EXPECT_TRUE(readings[0].gyro[0].valid);
}

std::string believed_text(const std::string& gyro, const std::string& temperature, const std::string& uhfo) {
  return R"({"format": "prism-frames", "version": 1, "name": "small", "line": {"baud": 9600}, "rate_hz": 10,
    "kinds": [{"name": "k", "sync": {"bytes": "AB CD"}, "length": 8, "checks": {"kind": "sum", "to": -1, "at": -1},
               "fields": {"rate": {"at": 2, "type": "s16", "min": -100, "max": 100},
                          "t": {"at": 4, "type": "s16", "min": -80, "max": 125}, "u": {"at": 6, "type": "u8"}}}],
    "gyro": {"meaning": "rate", "unit": "deg/s", "axes": {"z": "rate"})" +
         gyro + R"(}, "temperature": {"field": "t")" + temperature + R"(}, "uhfo": {"field": "u")" + uhfo + "}}";
}

std::string refused_belief(const std::string& gyro, const std::string& temperature, const std::string& uhfo) {
  const auto parsed = parse_frame_description(believed_text(gyro, temperature, uhfo), "f.json");
  return parsed ? "accepted" : parsed.error().text();
}

TEST(Beliefs, AreReadInTheUnitsOfTheQuantities) {
  const auto d = test::description_of(believed_text(R"(, "range_deg_per_s": [-490, 490])",
                                                    R"(, "range": [-40, 75], "greatest_slope_degc_per_s": 0.5)",
                                                    R"(, "range": [0, 16])"));
  EXPECT_EQ(d->plausible.rate.range->max, 490 * 3600.0);
  EXPECT_EQ(d->plausible.temperature.range->min, -40);
  EXPECT_EQ(d->plausible.temperature.greatest_slope_per_s, 0.5);
  EXPECT_EQ(d->plausible.uhfo.range->max, 16);
  EXPECT_FALSE(d->plausible.temperature.stuck_s);
}

// Logs identify a description by its id: adding a plausibility limit does not change the decoding.
TEST(Beliefs, AreNotPartOfTheId) {
  const auto without = test::description_of(believed_text("", "", ""));
  const auto with = test::description_of(
      believed_text(R"(, "range_deg_per_s": [-1, 1])", R"(, "range": [-40, 75])", R"(, "range": [0, 1])"));
  EXPECT_EQ(without->id, with->id);
  EXPECT_FALSE(without->plausible.rate.range || without->plausible.temperature.range);
  EXPECT_NE(without->id, test::description_of(believed_text("", R"(, "stale_after_s": 2)", ""))->id);
}

TEST(Beliefs, ReportErrorsWithTheirPosition) {
  EXPECT_EQ(refused_belief("", R"(, "range": [75, -40])", ""),
            "f.json:/temperature/range: found [75, -40], expected [low, high], low below high");
  EXPECT_EQ(refused_belief("", R"(, "range": [1])", ""),
            "f.json:/temperature/range: found [1], expected [low, high], low below high");
  EXPECT_NE(
      refused_belief(R"(, "range_deg_per_s": "wide")", "", "").find("f.json:/gyro/range_deg_per_s: found \"wide\""),
      std::string::npos);
  EXPECT_NE(
      refused_belief("", R"(, "greatest_slope_degc_per_s": 0)", "").find("/temperature/greatest_slope_degc_per_s"),
      std::string::npos);
  EXPECT_EQ(refused_belief("", "", R"(, "greatest_slope_degc_per_s": 1)"),
            "f.json:/uhfo/greatest_slope_degc_per_s: only valid for the temperature");
}

// Units that differ from the role's: a temperature in K is 273.15 too high without a word.
TEST(Units, OfTheTemperatureAndTheVoltageAreChecked) {
  const auto refusal = [](const std::string& field, const std::string& unit) {
    std::string text = believed_text("", "", "");
    const std::string name = "\"" + field + "\": {";
    text.replace(text.find(name), name.size(), name + "\"unit\": \"" + unit + "\", ");
    const auto parsed = parse_frame_description(text, "f.json");
    return parsed ? "" : parsed.error().text();
  };
  EXPECT_EQ(refusal("t", "K"),
            "f.json:/temperature/field: the field \"t\" is in K, expected degC; add \"offset\": "
            "-273.15 to the field, and make its \"unit\" degC");
  EXPECT_EQ(refusal("t", "degF"), "f.json:/temperature/field: the field \"t\" is in degF, expected degC");
  EXPECT_EQ(refusal("t", "degC"), "");
}

std::vector<std::uint8_t> small_frame(int rate, int temperature) {
  std::vector<std::uint8_t> bytes = {0xAB, 0xCD};
  for (const int value : {rate, temperature}) {
    bytes.push_back(static_cast<std::uint8_t>(value >> 8));
    bytes.push_back(static_cast<std::uint8_t>(value));
  }
  bytes.push_back(5);
  int sum = 0;
  for (const std::uint8_t byte : bytes) sum += byte;
  bytes.push_back(static_cast<std::uint8_t>(sum));
  return bytes;
}

TEST(OutOfBounds, IsReportedForEachQuantity) {
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < 8; ++i) {
    const auto one = small_frame(i == 4 ? 1000 : 10, i >= 5 ? -273 : 25);
    bytes.insert(bytes.end(), one.begin(), one.end());
  }
  const auto readings = test::decode(test::description_of(believed_text("", "", "")), bytes);
  ASSERT_EQ(readings.size(), 8u);
  for (std::size_t i = 0; i < readings.size(); ++i) {
    EXPECT_EQ(readings[i].out_of_bounds, (QuantitySet{false, i >= 5, false})) << i;
    EXPECT_EQ(readings[i].gyro[0].out_of_bounds, i == 4) << i;
    EXPECT_EQ(std::isnan(readings[i].temperature_degc), i >= 5) << i;
    EXPECT_EQ(readings[i].gyro[0].valid, i != 4) << i;
  }
}

}  // namespace
}  // namespace prism::wire
