// SPDX-License-Identifier: MIT
// Properties of every shipped description: the decoder reads all encoded values, and no intact frame is lost.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "drivers/wire/decode/inspect.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct Stream {
  Bytes bytes;
  std::vector<test::Part> frames;
};

double below(std::mt19937& random, unsigned limit) { return static_cast<double>(random() % limit); }

Stream stream_of(const FrameDescriptionPtr& description, int frames) {
  FrameEncoder encoder(description);
  Stream stream;
  std::mt19937 random(11);
  for (int i = 0; i < frames; ++i) {
    const std::size_t begin = stream.bytes.size();
    const double rate = 30 * std::sin(0.01 * i) + 1e-3 * below(random, 1000);
    encoder.encode({.rate_deg_per_h = {rate},
                    .interval_s = description->period_s(),
                    .temperature_degc = 20 + 1e-3 * below(random, 10000),
                    .uhfo_v = 2 + 1e-4 * below(random, 1000)},
                   stream.bytes);
    stream.frames.push_back({begin, stream.bytes.size() - begin});
  }
  return stream;
}

class Shipped : public testing::TestWithParam<std::string> {};

constexpr double kRateDegPerH = -7250.5;
constexpr int kFrames = 600;

/// kFrames frames of a steady gyro, fed frame by frame.
std::vector<DecodedMessage> readings_of(const FrameDescriptionPtr& description, double interval_s,
                                        DecoderCounters& counters) {
  FrameEncoder encoder(description);
  FrameDecoder decoder(description);
  Bytes bytes;
  std::vector<DecodedMessage> readings;
  for (int i = 0; i < kFrames; ++i) {
    bytes.clear();
    encoder.encode(
        {.rate_deg_per_h = {kRateDegPerH}, .interval_s = interval_s, .temperature_degc = 21.5, .uhfo_v = 2.31}, bytes);
    decoder.feed(bytes, i, readings);
  }
  decoder.finish(readings);
  counters = decoder.counters();
  return readings;
}

/// One wire unit in deg/h or arcsec; for floats a small part of the value.
double resolution(const FrameDescription& description) {
  for (const MessageType& kind : description.kinds) {
    if (!kind.roles.carries_gyro()) continue;
    const Field& field = kind.fields[static_cast<std::size_t>(kind.roles.axes[0].gyro[0])];
    const bool whole = field.type == NumberType::kSigned || field.type == NumberType::kUnsigned;
    if (whole) return std::abs(description.axes[0].scale * field.scaling.scale);
  }
  return 0.02;
}

// Each axis decodes as if it were alone, independent of the values of the others.
TEST_P(Shipped, DecodesAxesTogetherAsAlone) {
  GyroChoice all;
  all.axes.clear();
  const std::vector<std::string> names = test::shipped(GetParam())->axis_names;
  for (const std::string& name : names) all.axes.push_back({.axis = name});
  const auto together = test::shipped(GetParam(), all);
  FrameEncoder encoder(together);
  Bytes bytes;
  for (int i = 0; i < kFrames; ++i) {
    GyroState state{.rate_deg_per_h = {1000.0 + i, -20.0 * i, 3000.0 - i, 40},
                    .interval_s = together->period_s(),
                    .temperature_degc = 21.5,
                    .uhfo_v = 2.31};
    for (std::size_t axis = 0; axis < all.axes.size(); ++axis) state.valid[axis] = (i / 50 >> axis & 1) == 0;
    encoder.encode(state, bytes);
  }
  const auto readings = test::decode(together, bytes);
  for (std::size_t axis = 0; axis < all.axes.size(); ++axis) {
    GyroChoice one;
    one.axes = {all.axes[axis]};
    const auto alone = test::decode(test::shipped(GetParam(), one), bytes);
    ASSERT_EQ(alone.size(), readings.size());
    for (std::size_t i = 0; i < alone.size(); ++i) {
      const AxisReading &mine = alone[i].gyro[0], &same = readings[i].gyro[axis];
      EXPECT_EQ(mine.carried, same.carried);
      EXPECT_EQ(mine.valid, same.valid);
      EXPECT_TRUE(mine.value == same.value || (std::isnan(mine.value) && std::isnan(same.value)));
    }
  }
}

TEST_P(Shipped, DecodesWhatItEncodes) {
  const std::vector<std::string> axes = test::shipped(GetParam())->axis_names;
  for (const std::string& axis : axes) {
    GyroChoice choice;
    choice.axes = {{.axis = axis}};
    const auto description = test::shipped(GetParam(), choice);
    const double interval_s = description->period_s() / static_cast<double>(description->sent_kinds.size());
    const double lsb = resolution(*description);
    DecoderCounters counters;
    double turned = 0;
    double temperature = kUnknown;
    const auto readings = readings_of(description, interval_s, counters);
    ASSERT_GE(readings.size(), static_cast<std::size_t>(kFrames - 20)) << axis;
    for (const DecodedMessage& reading : readings) {
      if (!std::isnan(reading.temperature_degc)) temperature = reading.temperature_degc;
      if (!reading.has_gyro) continue;
      ASSERT_TRUE(reading.gyro[0].valid) << axis << " at " << reading.offset;
      const double value = reading.gyro[0].value * description->axes[0].scale;
      if (description->gyro.meaning == RateEncoding::kRate) {
        ASSERT_NEAR(value, kRateDegPerH, 0.51 * lsb);
      }
      turned += value;
    }
    const double angle = kRateDegPerH * interval_s * kFrames;
    if (description->gyro.meaning == RateEncoding::kIncrement) {
      EXPECT_NEAR(turned, angle, 0.02 * std::abs(angle) + 2 * lsb) << axis;
    }
    if (description->has(ChannelRole::kTemperature)) {
      EXPECT_NEAR(temperature, 21.5, 1.0) << axis;
    }
    // A line of text is known to be complete only after the end of another one.
    const bool first_is_lost = description->kinds[static_cast<std::size_t>(description->sent_kinds[0])].after >= 0;
    EXPECT_LE(counters.skipped_bytes, first_is_lost ? description->max_frame_bytes : 0u) << axis;
    EXPECT_EQ(counters.resyncs, 0u) << axis;
  }
}

TEST_P(Shipped, LosesNoIntactFrame) {
  const auto description = test::shipped(GetParam());
  const Stream stream = stream_of(description, 3000);
  for (const test::Damage what : test::kDamages) {
    const auto [lost, seen] = test::lost_frames(description, stream.bytes, stream.frames, what);
    // Less than 16 bits identify the frame, or a frame needs the end of the previous one, which may be damaged.
    const MessageType& kind = description->kinds[static_cast<std::size_t>(description->sent_kinds[0])];
    const double allowed = kind.weak || kind.after >= 0 ? 0.25 * static_cast<double>(seen) : 0;
    EXPECT_LE(static_cast<double>(lost), allowed) << seen << " found after damage " << static_cast<int>(what);
    EXPECT_GT(seen, 0u);
  }
}

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }
bool same(const DecodedMessage& a, const DecodedMessage& b) {
  return a.offset == b.offset && a.length == b.length && a.kind == b.kind && a.counter == b.counter &&
         same(a.gyro[0].value, b.gyro[0].value) && same(a.temperature_degc, b.temperature_degc) &&
         same(a.uhfo_v, b.uhfo_v) && a.status == b.status && a.gyro[0].valid == b.gyro[0].valid;
}

std::vector<std::uint64_t> counts(const DecoderCounters& c) {
  return {c.bytes,   c.frames,        c.bad_check, c.bad_length,  c.bad_body,
          c.refused, c.skipped_bytes, c.resyncs,   c.unconfirmed, c.out_of_range};
}

TEST_P(Shipped, ReturnsTheSameFramesForAnyChunks) {
  const auto description = test::shipped(GetParam());
  const Stream stream = stream_of(description, 300);
  const test::Damaged damaged = test::damage(stream.bytes, stream.frames, test::Damage::kDrop, 5);
  FrameDecoder at_once(description);
  std::vector<DecodedMessage> whole;
  at_once.feed(damaged.bytes, 0, whole);
  at_once.finish(whole);
  for (unsigned seed = 0; seed < 8; ++seed) {
    std::mt19937 random(seed);
    FrameDecoder decoder(description);
    std::vector<DecodedMessage> cut;
    for (std::size_t at = 0; at < damaged.bytes.size();) {
      const std::size_t size = std::min<std::size_t>(damaged.bytes.size() - at, 1 + random() % 50);
      decoder.feed({damaged.bytes.data() + at, size}, 0, cut);
      at += size;
    }
    decoder.finish(cut);
    ASSERT_EQ(cut.size(), whole.size()) << "seed " << seed;
    for (std::size_t i = 0; i < cut.size(); ++i) ASSERT_TRUE(same(cut[i], whole[i])) << "seed " << seed << ", " << i;
    EXPECT_EQ(counts(decoder.counters()), counts(at_once.counters())) << "seed " << seed;
  }
}

TEST_P(Shipped, FindsNoFrameInGarbageWithStrongChecks) {
  const auto description = test::shipped(GetParam());
  std::mt19937 random(23);
  Bytes bytes(300'000);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
  const auto readings = test::decode(description, bytes);
  int least_bits = 64;
  for (const MessageType& kind : description->kinds) {
    int sync_bits = 0;
    for (const ByteRule& rule : kind.sync) sync_bits += std::popcount(rule.mask);
    if (kind.roles.tells_anything())
      least_bits = std::min(least_bits, (sync_bits + kind.check_bits) * kind.confirmations);
  }
  const double expected = 300'000 * static_cast<double>(description->kinds.size()) * std::pow(2.0, -least_bits);
  EXPECT_LE(static_cast<double>(readings.size()), 10 + 20 * expected) << "kinds of " << least_bits << " bits";
  if (least_bits >= 32) {
    EXPECT_TRUE(readings.empty());
  }
}

std::string test_name(const testing::TestParamInfo<std::string>& one) {
  std::string name = one.param;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Descriptions, Shipped, testing::ValuesIn(test::shipped_gyros()), test_name);
INSTANTIATE_TEST_SUITE_P(ForTests, Shipped, testing::ValuesIn(test::described()), test_name);

TEST(ShippedDescriptions, LoadAndDecodeTheirOwnTestVectors) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(test::frames_dir())) {
    if (entry.path().extension() != ".json" || entry.path().filename() == "frame.schema.json") continue;
    const auto parsed = parse_frame_description(test::read_file(entry.path()), entry.path().filename().string());
    ASSERT_TRUE(parsed) << parsed.error().text();
    EXPECT_EQ((*parsed)->name, entry.path().stem()) << "the file is named after the description";
    EXPECT_FALSE((*parsed)->source.empty()) << entry.path();
    EXPECT_FALSE((*parsed)->test_vectors.empty()) << entry.path();
    const auto vectors = run_test_vectors(**parsed);
    EXPECT_TRUE(vectors) << vectors.error().text();
    ++count;
  }
  EXPECT_GE(count, 24);
}

TEST(ShippedDescriptions, ReportAWrongValueOfAVector) {
  std::string text = test::read_file(test::frames_dir() / "trplg.json");
  const std::size_t at = text.find("\"counter\": 4660");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, 15, "\"counter\": 4661");
  const auto result = run_test_vectors(*test::description_of(text));
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().text(), "test.json:/vectors/0: counter is 4660; expected 4661");
}

TEST(ShippedDescriptions, RequireOneCompleteFramePerVector) {
  std::string text = test::read_file(test::frames_dir() / "trplg.json");
  const std::size_t at = text.find("00 07 63 4D");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, 11, "00 07 63 4D A5");
  const auto result = run_test_vectors(*test::description_of(text));
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().text(),
            "test.json:/vectors/0: 20 of 21 bytes are a frame; expected one frame of message type data");
}

std::string hex(const std::vector<std::uint8_t>& bytes) {
  std::string text;
  for (const auto byte : bytes) text += fmt::format("{}{:02X}", text.empty() ? "" : " ", byte);
  return text;
}

TEST(Documents, WirePageShowsTheTestVectors) {
  const std::string page = test::read_file(std::filesystem::path(PRISM_SOURCE_DIR) / "docs" / "wire.md");
  for (const char* name : {"trplg", "trplg-increment"}) {
    const auto description = test::shipped(name);
    ASSERT_FALSE(description->test_vectors.empty());
    EXPECT_NE(page.find("    " + hex(description->test_vectors[0].bytes) + "\n"), std::string::npos) << name;
  }
}

std::string frames_page() { return test::read_file(std::filesystem::path(PRISM_SOURCE_DIR) / "docs" / "frames.md"); }

/// The example JSON in docs/frames.md.
std::string course_description() {
  const std::string page = frames_page();
  const std::size_t begin = page.find("```json\n") + 8;
  return page.substr(begin, page.find("```\n", begin) - begin);
}

TEST(Documents, FramesPageExampleDecodesItsVector) {
  const auto description = test::description_of(course_description());
  ASSERT_EQ(description->test_vectors.size(), 1u);
  const auto proved = run_test_vectors(*description);
  EXPECT_TRUE(proved) << proved.error().text();
}

/// The reader's error for the example after one change.
std::string course_refusal(const std::string& from, const std::string& to) {
  std::string text = course_description();
  text.replace(text.find(from), from.size(), to);
  const auto parsed = parse_frame_description(text, "ex-1.json");
  if (!parsed) return parsed.error().text();
  const auto proved = run_test_vectors(**parsed);
  return proved ? "accepted" : proved.error().text();
}

TEST(Documents, FramesPageShowsTheReadersErrors) {
  const std::string page = frames_page();
  for (const auto& [from, to] : {std::pair{"\"at\": 4, \"type\": \"u8\"", "\"at\": 4, \"type\": \"u16\""},
                                 std::pair{"\"rate_hz\": 100", "\"rate_hz\": 2000"},
                                 std::pair{"FF DF 07 2A 98 01 01 41", "FF DF 06 2A 98 01 01 23"}}) {
    EXPECT_NE(page.find("    " + course_refusal(from, to) + "\n"), std::string::npos) << course_refusal(from, to);
  }
}

TEST(Documents, EveryShippedDescriptionIsListed) {
  const std::string page = frames_page();
  for (const auto& entry : std::filesystem::directory_iterator(test::frames_dir())) {
    if (entry.path().stem() == "frame.schema") continue;
    EXPECT_NE(page.find("`" + entry.path().stem().string() + "`"), std::string::npos) << entry.path().stem();
  }
}

}  // namespace
}  // namespace prism::wire
