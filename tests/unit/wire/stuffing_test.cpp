// SPDX-License-Identifier: MIT
// Byte stuffing: published bytes, bytes of independent encoders (data/stuffing.txt), damage, bounds, cuts.
#include "drivers/wire/description/stuffing.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <sstream>

#include "drivers/wire/decode/inspect.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

using testing::ElementsAre;

using Bytes = std::vector<std::uint8_t>;

Bytes of_hex(const std::string& hex) {
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  return bytes;
}

Stuffing stuffing_of(const std::string& name) {
  return name == "slip" ? Stuffing::kSlip : name == "cobs" ? Stuffing::kCobs : Stuffing::kHdlc;
}

struct Row {
  std::string name;
  Stuffing stuffing = Stuffing::kNone;
  Bytes frame, line;
  bool decode_only = false;
};

std::vector<Row> rows() {
  std::istringstream in(test::read_file(std::filesystem::path(PRISM_SOURCE_DIR) / "tests/unit/wire/data/stuffing.txt"));
  std::vector<Row> all;
  for (std::string text; std::getline(in, text);) {
    if (text.starts_with('#')) continue;
    std::istringstream words(text);
    std::string name, frame, line, only;
    words >> name >> frame >> line >> only;
    all.push_back({text.substr(0, 60), stuffing_of(name), of_hex(frame), of_hex(line), only == "decode"});
  }
  return all;
}

/// All complete frames, and an empty one for each bad frame.
std::vector<Bytes> unstuffed(Stuffing stuffing, const Bytes& line, std::size_t max_bytes = 1000) {
  Unstuffer unstuffer(stuffing, max_bytes);
  std::vector<Bytes> frames;
  for (const std::uint8_t byte : line) {
    const Unstuffer::Step step = unstuffer.push(byte);
    if (step == Unstuffer::Step::kFrame) frames.push_back(unstuffer.frame());
    if (step == Unstuffer::Step::kBad) frames.emplace_back();
  }
  return frames;
}

TEST(Stuffing, DecodesTheBytesOfOtherEncoders) {
  EXPECT_GE(rows().size(), 40u);
  for (const Row& row : rows()) EXPECT_THAT(unstuffed(row.stuffing, row.line), ElementsAre(row.frame)) << row.name;
}

TEST(Stuffing, EncodesTheSameBytesAsOthers) {
  for (const Row& row : rows()) {
    if (row.decode_only) continue;
    Bytes line;
    stuff(row.stuffing, row.frame, line);
    EXPECT_EQ(line, row.line) << row.name;
  }
}

TEST(Stuffing, DamageLosesOnlyItsFrame) {
  const Bytes good = {1, 2};
  EXPECT_THAT(unstuffed(Stuffing::kSlip, of_hex("C0DB01C0C00102C0")), ElementsAre(Bytes{}, good)) << "a wrong escape";
  EXPECT_THAT(unstuffed(Stuffing::kSlip, of_hex("C001DBC0C00102C0")), ElementsAre(Bytes{}, good));
  EXPECT_THAT(unstuffed(Stuffing::kHdlc, of_hex("7E017D7E01027E")), ElementsAre(Bytes{}, good)) << "an abort";
  EXPECT_THAT(unstuffed(Stuffing::kCobs, of_hex("05010003010200")), ElementsAre(Bytes{}, good)) << "an early zero";
}

TEST(Stuffing, BoundsAFrame) {
  for (const Stuffing stuffing : {Stuffing::kSlip, Stuffing::kCobs, Stuffing::kHdlc}) {
    Bytes line;
    stuff(stuffing, Bytes(50, 7), line);
    stuff(stuffing, Bytes(51, 7), line);
    stuff(stuffing, Bytes(50, 8), line);
    EXPECT_THAT(unstuffed(stuffing, line, 50), ElementsAre(Bytes(50, 7), Bytes{}, Bytes(50, 8)));
  }
}

const char* const kAll[] = {"slip", "cobs", "shtp-uart"};

Bytes frames_of(const FrameDescriptionPtr& description, int count) {
  FrameEncoder encoder(description);
  Bytes out;
  for (int i = 0; i < count; ++i)
    encoder.encode({.rate_deg_per_h = {1000.0 + 500 * i}, .interval_s = 0.01, .temperature_degc = 20}, out);
  return out;
}

TEST(StuffedFrames, HaveTheArrivalOfTheirLastDelimiter) {
  const auto description = test::shipped("slip");
  const Bytes bytes = of_hex("C0FFFFFFDBDC00DBDCDBDD8549C0");
  FrameDecoder decoder(description);
  std::vector<DecodedMessage> out;
  decoder.feed(std::span(bytes).first(13), 1'000'000, out);
  EXPECT_TRUE(out.empty());
  EXPECT_TRUE(decoder.waiting());
  decoder.feed(std::span(bytes).subspan(13), 2'000'000, out);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].offset, 0u);
  EXPECT_EQ(out[0].length, 14u) << "with its delimiters and escapes";
  EXPECT_EQ(out[0].arrival_ns, 2'000'000);
  EXPECT_FALSE(decoder.waiting());
}

TEST(StuffedFrames, AreTheSameForAnyCut) {
  for (const char* name : kAll) {
    const auto description = test::shipped(name);
    const Bytes bytes = frames_of(description, 4);
    const auto whole = test::decode(description, bytes);
    ASSERT_EQ(whole.size(), 4u) << name;
    for (std::size_t cut = 1; cut < bytes.size(); ++cut) {
      FrameDecoder decoder(description);
      std::vector<DecodedMessage> out;
      decoder.feed(std::span(bytes).first(cut), 0, out);
      decoder.feed(std::span(bytes).subspan(cut), 0, out);
      decoder.finish(out);
      ASSERT_EQ(out.size(), whole.size()) << name << " cut at " << cut;
      for (std::size_t i = 0; i < out.size(); ++i) {
        EXPECT_EQ(out[i].offset, whole[i].offset);
        EXPECT_EQ(out[i].gyro[0].value, whole[i].gyro[0].value);
      }
      EXPECT_EQ(decoder.counters().skipped_bytes, 0u);
      EXPECT_EQ(decoder.held_bytes(), 0u);
    }
  }
}

// Each byte of the middle frame is replaced, removed or doubled. Only a delimiter that two frames share can lose two.
TEST(StuffedFrames, LoseOnlyTheDamagedFrame) {
  for (const char* name : {"slip", "cobs"}) {
    const auto description = test::shipped(name);
    const Bytes all = frames_of(description, 5);
    const auto whole = test::decode(description, all);
    ASSERT_EQ(whole.size(), 5u);
    const std::size_t shared = std::string(name) == "cobs" ? 1 : 0;
    for (std::size_t at = whole[2].offset; at < whole[2].offset + whole[2].length; ++at) {
      for (unsigned value = 0; value < 256; ++value) {
        Bytes bytes = all;
        if (bytes[at] == value) continue;
        const bool delimiter = at + 1 == whole[2].offset + whole[2].length;
        bytes[at] = static_cast<std::uint8_t>(value);
        const auto out = test::decode(description, bytes);
        ASSERT_GE(out.size(), 4 - (delimiter ? shared : 0)) << name << " byte " << at << " is " << value;
        for (const DecodedMessage& message : out)
          ASSERT_TRUE(message.counter >= 1 && message.counter <= 5) << name << " byte " << at << " is " << value;
        ASSERT_LE(out.size(), 5u);
      }
    }
  }
}

TEST(StuffedFrames, SkipGarbageInBoundedMemory) {
  for (const char* name : kAll) {
    FrameDecoder decoder(test::shipped(name));
    std::mt19937 random(3);
    std::vector<DecodedMessage> out;
    for (int i = 0; i < 200; ++i) {
      Bytes bytes(5000);
      // Half of the chunks have no delimiter at all.
      for (auto& byte : bytes) byte = static_cast<std::uint8_t>(i % 2 == 0 ? random() : 0x41 + random() % 26);
      decoder.feed(bytes, i, out);
      ASSERT_LE(decoder.held_bytes(), 200u) << name;
    }
    decoder.finish(out);
    EXPECT_TRUE(out.empty()) << name;
    EXPECT_EQ(decoder.counters().skipped_bytes + static_cast<std::uint64_t>(decoder.held_bytes()),
              decoder.counters().bytes)
        << name << ": except delimiters between frames";
  }
}

TEST(StuffedFrames, AreNotTakenFromTheRestOfAFrame) {
  // Without a check, the end of a frame looks like a shorter frame.
  const auto description = test::description_of(R"({"format": "prism-frames", "version": 1, "name": "x",
    "line": {"baud": 115200}, "rate_hz": 100, "stuffing": "slip",
    "kinds": [{"name": "k", "length": {"min": 2, "max": 4}, "fields": {"r": {"at": 0, "type": "u8"}}}],
    "gyro": {"meaning": "rate", "unit": "deg/h", "axes": {"z": "r"}}})");
  const auto readings = test::decode(description, of_hex("0304C0C001020304C0C001020304C0"));
  ASSERT_EQ(readings.size(), 2u);
  EXPECT_EQ(readings[0].gyro[0].value, 1);
}

TEST(StuffedFrames, RejectKeysThatHaveNoMeaning) {
  const auto error_of = [](const std::string& top, const std::string& type, const std::string& vector) {
    const auto parsed = parse_frame_description(
        R"({"format": "prism-frames", "version": 1, "name": "x", "line": {"baud": 115200}, "rate_hz": 1, )" + top +
            R"("kinds": [{"name": "k", )" + type + R"(, "fields": {"r": {"at": 0, "type": "u8"}}}],
        "gyro": {"meaning": "rate", "unit": "deg/h", "axes": {"z": "r"}}, "vectors": [)" +
            vector + "]}",
        "t.json");
    return parsed ? std::string("good") : parsed.error().text();
  };
  const std::string slip = R"("stuffing": "slip", )";
  EXPECT_EQ(error_of(slip, R"("length": 2)", ""), "good");
  EXPECT_EQ(error_of(slip, R"("length": {"min": 2, "max": 3})", ""), "good");
  EXPECT_EQ(error_of("", R"("sync": {"bytes": "AA"}, "length": {"min": 2, "max": 3})", ""),
            "t.json:/kinds/0/length: \"at\" is missing");
  EXPECT_EQ(error_of(R"("stuffing": "base64", )", R"("length": 2)", ""),
            "t.json:/stuffing: found \"base64\", expected \"none\" or \"slip\" or \"cobs\" or \"hdlc\"");
  EXPECT_EQ(error_of(slip, R"("length": 2, "after": "0A")", ""), "t.json:/kinds/0/after: not valid with \"stuffing\"");
  EXPECT_EQ(error_of(slip, R"("length": 2, "trailer": "0A")", ""),
            "t.json:/kinds/0/trailer: not valid with \"stuffing\"");
  EXPECT_EQ(error_of(slip, R"("length": 2)", R"({"stuffed": "C0 01 02", "kind": "k"})"),
            "t.json:/vectors/0/stuffed: is not one frame that ends with its delimiter");
  EXPECT_EQ(error_of("", R"("sync": {"bytes": "AA"}, "length": 2)", R"({"stuffed": "C0 01 02 C0", "kind": "k"})"),
            "t.json:/vectors/0/stuffed: the description has no \"stuffing\"");
}

}  // namespace
}  // namespace prism::wire
