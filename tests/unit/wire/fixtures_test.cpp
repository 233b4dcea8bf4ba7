// SPDX-License-Identifier: MIT
// Real bytes of real devices, decoded by descriptions: the values match their sources, and damage is rejected.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "tests/unit/wire/fixture_files.hpp"

namespace prism::wire {
namespace {

using test::Bytes;
using test::bytes_of;
using test::hex_frames;
using test::values_of;
using test::walk;

TEST(Fixtures, KvhFramesMatchManualAndDriver) {
  PRISM_NEEDS_SHARED("frames/kvh1750_1775_format_a.hex");
  const auto frames = hex_frames("kvh1750_1775_format_a.hex");
  ASSERT_EQ(frames.size(), 4u);
  const auto description = test::shipped("kvh1750");
  auto sample = values_of(description, frames[0].second);
  EXPECT_NEAR(sample["gyro_x"], 2.019593e-05, 1e-11);
  EXPECT_NEAR(sample["gyro_z"], -1.3111248e-05, 1e-11);
  EXPECT_EQ(sample["sequence"], 61);
  EXPECT_EQ(sample["temperature"], 40);
  EXPECT_EQ(values_of(description, frames[1].second)["status"], 0x70);
  EXPECT_EQ(values_of(description, frames[2].second)["sequence"], 104);
  EXPECT_TRUE(values_of(description, frames[3].second).empty());
}

TEST(Fixtures, KvhValidityBitsReachTheReading) {
  PRISM_NEEDS_SHARED("frames/kvh1750_1775_format_a.hex");
  const auto frames = hex_frames("kvh1750_1775_format_a.hex");
  Bytes stream;
  for (const auto& [name, bytes] : frames) stream.insert(stream.end(), bytes.begin(), bytes.end());
  const auto readings = test::decode(test::shipped("kvh1750"), stream);
  ASSERT_EQ(readings.size(), 3u);
  EXPECT_TRUE(readings[0].gyro[0].valid);
  EXPECT_FALSE(readings[1].gyro[0].valid) << "start-up: the gyros are not valid yet";
  EXPECT_EQ(readings[2].counter, 104u);
  EXPECT_EQ(readings[2].temperature_degc, 29);
}

TEST(Fixtures, RejectsMisprintedKvhTestMessages) {
  const auto frames = hex_frames("kvh_bit.hex");
  ASSERT_EQ(frames.size(), 4u);
  const auto description = test::shipped("kvh1750");
  EXPECT_EQ(values_of(description, frames[0].second)["length"], 11);
  EXPECT_EQ(values_of(description, frames[1].second)["bit_6"], 0x37);
  EXPECT_TRUE(values_of(description, frames[2].second).empty());
  EXPECT_TRUE(values_of(description, frames[3].second).empty());
}

TEST(Fixtures, DspAsciiDropsATruncatedLine) {
  PRISM_NEEDS_SHARED("frames/kvh_dsp3000_ascii.txt");
  std::string text = test::read_file(test::shared_dir() / "frames/kvh_dsp3000_ascii.txt");
  while (text.starts_with('#')) text.erase(0, text.find('\n') + 1);
  std::string stream = "\r\n";
  for (const char c : text) stream += c == '\n' ? std::string("\r\n") : c == '\r' ? std::string() : std::string(1, c);
  stream += "       0.015733   1\r\n";  // the last one of the file is confirmed by one after it
  const auto readings = test::decode(test::shipped("dsp3000-ascii"), {stream.begin(), stream.end()});
  ASSERT_GE(readings.size(), 2u);
  for (const DecodedMessage& reading : readings) EXPECT_DOUBLE_EQ(reading.gyro[0].value, 0.015733);
}

TEST(Fixtures, Stim300DatagramDecodesExactly) {
  PRISM_NEEDS_SHARED("frames/stim300_af.hex");
  const auto readings = test::decode(test::shipped("stim300"), hex_frames("stim300_af.hex")[0].second);
  ASSERT_EQ(readings.size(), 1u);
  EXPECT_EQ(readings[0].gyro[0].value, 0.017822265625);
  EXPECT_EQ(readings[0].temperature_degc, 35.625);
  EXPECT_EQ(readings[0].counter, 225u);
  EXPECT_DOUBLE_EQ(readings[0].latency_s, 506e-6);
  EXPECT_TRUE(readings[0].gyro[0].valid);
}

TEST(Fixtures, AstrixChecksumMatches) {
  const Bytes frame = hex_frames("exail_astrix_ns.hex")[0].second;
  auto values = values_of(test::shipped("astrix-ns"), frame);
  EXPECT_EQ(values["address"], 0x12);
  EXPECT_EQ(values["id"], 2);
}

TEST(Fixtures, IxblueTelegramsHaveTheirHeadingsAndRates) {
  PRISM_NEEDS_SHARED("frames/ixblue_stdbin_v3.bin");
  const auto description = test::shipped("ixblue-stdbin");
  auto v2 = walk(description, bytes_of("ixblue_stdbin_v2.bin"));
  ASSERT_EQ(v2.size(), 1u);
  EXPECT_NEAR(v2[0]["heading"], 209.982, 5e-4);
  EXPECT_NEAR(v2[0]["roll"], 0.016, 5e-4);
  EXPECT_NEAR(v2[0]["pitch"], 0.206, 5e-4);
  EXPECT_NEAR(v2[0]["rate_x"], .001287996, 1e-8);
  EXPECT_NEAR(v2[0]["rate_y"], .0010229985, 1e-8);
  EXPECT_NEAR(v2[0]["rate_z"], .0026694948, 1e-8);
  EXPECT_EQ(walk(description, bytes_of("ixblue_stdbin_v3_old.bin")).size(), 1u);
  auto v3 = walk(description, bytes_of("ixblue_stdbin_v3.bin"));
  ASSERT_EQ(v3.size(), 17u);
  EXPECT_NEAR(v3[0]["roll"], .809, 5e-4);
  EXPECT_NEAR(v3[0]["pitch"], -.521, 5e-4);
  EXPECT_NEAR(v3[0]["rate_x"], -.00136, 1e-6);
  EXPECT_NEAR(v3[0]["rate_y"], -.002145, 1e-6);
  for (std::size_t i = 0; i < v3.size(); ++i) {
    EXPECT_EQ(v3[i]["counter"], static_cast<double>(8 + i));
    EXPECT_NEAR(v3[i]["time"] - v3[i > 0 ? i - 1 : 0]["time"], i > 0 ? 1 : 0, 1.1e-4);
  }
}

TEST(Fixtures, PhinsSentencesDecode) {
  PRISM_NEEDS_SHARED("frames/ixblue_phins_nmea.txt");
  std::string text;
  for (const char c : test::read_file(test::shared_dir() / "frames/ixblue_phins_nmea.txt")) {
    if (c == '\n') text += '\r';
    if (c != '\r') text += c;
  }
  const auto sentences = walk(test::shipped("ixblue-phins-nmea"), {text.begin(), text.end()});
  ASSERT_EQ(sentences.size(), 6u);
  EXPECT_DOUBLE_EQ(sentences[0].at("heading"), 5.021);
  EXPECT_DOUBLE_EQ(sentences[2].at("sway"), 0.407);
}

TEST(Fixtures, NovatelBinaryAndAsciiAgree) {
  PRISM_NEEDS_SHARED("frames/novatel_rawimusx.hex");
  const auto description = test::shipped("novatel-rawimusx");
  const auto frames = hex_frames("novatel_rawimusx.hex");
  ASSERT_EQ(frames.size(), 3u);
  std::istringstream in(test::read_file(test::shared_dir() / "frames/novatel_rawimusx.txt"));
  for (std::size_t i = 0; i < 2; ++i) {
    std::string line;
    ASSERT_TRUE(std::getline(in, line));
    while (!line.empty() && line.back() == '\r') line.pop_back();
    line += "\r\n";
    auto ascii = values_of(description, std::span(reinterpret_cast<const std::uint8_t*>(line.data()), line.size()));
    auto binary = values_of(description, frames[i].second);
    ASSERT_FALSE(ascii.empty() || binary.empty()) << line;
    for (const char* field : {"info", "imu_type", "week", "status", "accel_z", "accel_minus_y", "accel_x", "gyro_z",
                              "gyro_minus_y", "gyro_x"}) {
      EXPECT_EQ(ascii[std::string("text_") + field], binary[field]) << field;
    }
    EXPECT_NEAR(ascii["text_seconds"], binary["seconds"], 1e-9);
  }
  const auto readings = test::decode(description, frames[2].second);
  ASSERT_EQ(readings.size(), 1u) << "false syncs in front of a frame";
  EXPECT_EQ(readings[0].offset, 14u);
}

TEST(Fixtures, TheFrameInVectorNavsManualDecodes) {
  auto values = values_of(test::shipped("vectornav"), hex_frames("vectornav_ypr.hex")[0].second);
  EXPECT_NEAR(values["yaw"], 43.578686, 1e-5);
}

TEST(Fixtures, AVectorNavLineDecodes) {
  PRISM_NEEDS_SHARED("frames/vectornav_vnimu.txt");
  std::string line = test::read_file(test::shared_dir() / "frames/vectornav_vnimu.txt");
  while (!line.empty() && (line.back() == '\r' || line.back() == '\n')) line.pop_back();
  line += "\r\n";
  auto values =
      values_of(test::shipped("vectornav"), std::span(reinterpret_cast<const std::uint8_t*>(line.data()), line.size()));
  EXPECT_DOUBLE_EQ(values["text_rate_z"], -0.044656);
}

TEST(Fixtures, GeneratedFramesOfEveryListedDeviceDecode) {
  const std::map<std::string, std::string> description_by_frame = {
      {"cn80_10_two_checks", "xor7-10"}, {"avic_f50b_7", "xor7-f50b"},
      {"ls_fog_01", "ls-fog-01"},        {"mostatech", "mostatech"},
      {"fizoptika", "fizoptika"},        {"hg4930_01", "hg4930"},
      {"hg4930_02", "hg4930"},           {"hg1120_04", "hg1120"},
      {"stim210_a8", "stim210"},         {"dmu11", "dmu11"},
      {"stim300_90", "stim300"},         {"stim300_91", "stim300"},
      {"stim300_94", "stim300"},         {"stim300_a5", "stim300"},
      {"stim300_a7", "stim300"},         {"stim300_f4", "stim300"},
      {"stim300_f7", "stim300"}};
  int decoded = 0;
  for (const auto& [name, bytes] : hex_frames("spec_frames.hex")) {
    const auto known = description_by_frame.find(name);
    if (known == description_by_frame.end()) continue;  // fog60_7: its checksum rule is not known
    EXPECT_EQ(values_of(test::shipped(known->second), bytes)["length"], static_cast<double>(bytes.size())) << name;
    ++decoded;
  }
  EXPECT_EQ(decoded, 24);
}

TEST(Fixtures, FizoptikaHalvesAreJoinedOnlyWhenAdjacent) {
  Bytes stream;
  for (const auto& [name, bytes] : hex_frames("spec_frames.hex")) {
    if (name == "fizoptika") stream.insert(stream.end(), bytes.begin(), bytes.end());
  }
  ASSERT_EQ(stream.size(), 64u);
  const auto description = test::shipped("fizoptika");
  const auto whole = test::decode(description, stream);
  ASSERT_EQ(whole.size(), 8u);
  EXPECT_TRUE(std::isnan(whole[0].temperature_degc));
  EXPECT_NEAR(whole[1].temperature_degc, 0x2666 * 250.0 / 32768 - 50, 1e-9);
  EXPECT_NEAR(whole[3].uhfo_v, 5.0, 1e-9);
  stream[8] ^= 1;  // the low half's frame is damaged: no temperature, and none made of two others
  const auto torn = test::decode(description, stream);
  ASSERT_EQ(torn.size(), 7u);
  EXPECT_TRUE(std::isnan(torn.back().temperature_degc));
  EXPECT_NEAR(torn.back().uhfo_v, 5.0, 1e-9);
}

}  // namespace
}  // namespace prism::wire
