// SPDX-License-Identifier: MIT
// Real bytes of real devices, decoded by descriptions: the values match their sources, and damage is rejected.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "drivers/wire/decode/inspect.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Frames that a manual prints, or that were made from documents, are in the source tree; recorded bytes are shared
/// data.
std::filesystem::path frames_file(const std::string& file) {
  const auto here = std::filesystem::path(PRISM_SOURCE_DIR) / "tests" / "unit" / "wire" / "data" / file;
  return std::filesystem::exists(here) ? here : test::shared_dir() / "frames" / file;
}

Bytes bytes_of(const std::string& file) {
  const std::string text = test::read_file(frames_file(file));
  return {text.begin(), text.end()};
}

/// The frames of a .hex file by their names, in order.
std::vector<std::pair<std::string, Bytes>> hex_frames(const std::string& file) {
  std::istringstream in(test::read_file(frames_file(file)));
  std::vector<std::pair<std::string, Bytes>> frames;
  for (std::string line; std::getline(in, line);) {
    if (const auto at = line.find("# frame: "); at != std::string::npos) {
      std::istringstream words(line.substr(at + 9));
      words >> frames.emplace_back().first;
    } else if (!line.empty() && line[0] != '#') {
      std::istringstream words(line);
      for (std::string word; words >> word;)
        frames.back().second.push_back(static_cast<std::uint8_t>(std::stoi(word, nullptr, 16)));
    }
  }
  return frames;
}

std::map<std::string, double> values_of(const FrameDescriptionPtr& description, std::span<const std::uint8_t> bytes) {
  std::map<std::string, double> values;
  if (const auto frame = inspect_frame(*description, bytes)) {
    values["length"] = frame->length;
    for (const auto& value : frame->values) values[value.field] = value.value;
  }
  return values;
}

/// All consecutive frames of a stream; stops at the first other byte.
std::vector<std::map<std::string, double>> walk(const FrameDescriptionPtr& description, const Bytes& bytes) {
  std::vector<std::map<std::string, double>> frames;
  for (std::size_t at = 0; at < bytes.size();) {
    auto values = values_of(description, std::span(bytes).subspan(at));
    if (values.empty()) break;
    at += static_cast<std::size_t>(values["length"]);
    frames.push_back(std::move(values));
  }
  return frames;
}

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

/// The rates of turn of the golden text, in order: x, y, z, x, …
std::vector<double> golden_rates(const std::string& file) {
  std::istringstream in(test::read_file(test::shared_dir() / "frames" / file));
  std::vector<double> rates;
  int left = 0;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("RateOfTurn"))
      left = 3;
    else if (left > 0)
      rates.push_back(std::stod(line.substr(line.find(':') + 1))), --left;
  }
  return rates;
}

TEST(Captures, XsensRatesEqualTheGoldenRates) {
  PRISM_NEEDS_SHARED("frames/xsens_mtdata2_1.bin");
  int compared = 0;
  for (const std::string number : {"1", "2"}) {
    const auto golden = golden_rates("xsens_mtdata2_" + number + ".expected.txt");
    ASSERT_FALSE(golden.empty());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      GyroChoice choice;
      choice.axes = {{.axis = std::string(1, "xyz"[axis])}};
      const auto readings =
          test::decode(test::shipped("xsens-mtdata2", choice), bytes_of("xsens_mtdata2_" + number + ".bin"));
      ASSERT_EQ(readings.size(), 100u);
      std::size_t next = axis;
      for (std::size_t i = 0; i < readings.size(); ++i) {
        EXPECT_EQ(readings[i].counter, readings[0].counter + i);
        if (!readings[i].gyro[0].valid) continue;  // a message without a rate of turn
        ASSERT_LT(next, golden.size());
        EXPECT_EQ(readings[i].gyro[0].value, golden[next]);
        next += 3;
        ++compared;
      }
    }
  }
  EXPECT_EQ(compared, 2 * 288) << "every stated number of both files";
}

TEST(Captures, Mti630MessageDecodes) {
  PRISM_NEEDS_SHARED("frames/xsens_mti630.hex");
  auto values = values_of(test::shipped("xsens-mtdata2"), hex_frames("xsens_mti630.hex")[0].second);
  EXPECT_EQ(values["packet_counter"], 7109);
  double norm = 0;
  for (const char* q : {"quaternion_0", "quaternion_1", "quaternion_2", "quaternion_3"}) norm += values[q] * values[q];
  EXPECT_NEAR(norm, 1.00000002, 5e-9) << "the sum of the squares, as the source states it";
}

TEST(Captures, MipCaptureDecodesCompletely) {
  PRISM_NEEDS_SHARED("frames/mip_data.bin");
  FrameDecoder decoder(test::shipped("microstrain-mip"));
  std::vector<DecodedMessage> readings;
  decoder.feed(bytes_of("mip_data.bin"), 0, readings);
  decoder.finish(readings);
  EXPECT_EQ(decoder.counters().frames, 8384u);
  EXPECT_EQ(decoder.counters().skipped_bytes, 0u);
  std::size_t timed = 0;
  std::uint64_t last = 0;
  for (const DecodedMessage& reading : readings) {
    if (!reading.has_counter) continue;
    EXPECT_EQ(reading.counter - last, timed > 0 ? 8'000'000u : reading.counter);
    last = reading.counter;
    ++timed;
  }
  EXPECT_EQ(timed, 4473u);
}

TEST(Captures, MipExampleDecodes) {
  PRISM_NEEDS_SHARED("frames/mip_3dm.hex");
  auto values = values_of(test::shipped("microstrain-mip"), hex_frames("mip_3dm.hex")[0].second);
  EXPECT_NEAR(values["rate_x"], -0.0021380298, 1e-10);
  EXPECT_NEAR(values["accel_z"], -0.97923297, 1e-8);
  EXPECT_EQ(values["reference_time"], 23067000000);
}

/// One byte in a thousand flipped, dropped or followed by another; and the stream offsets of the frames it did not
/// touch.
struct Damaged {
  Bytes bytes;
  std::vector<std::uint64_t> intact;
};

enum class Damage { kFlip, kDrop, kInsert };

Damaged damage(const Bytes& good, const std::vector<DecodedMessage>& frames, Damage what) {
  std::mt19937 random(99);
  Damaged result;
  std::vector<std::uint64_t> new_offset(good.size() + 1);
  std::vector<bool> hit(good.size(), false);
  for (std::size_t i = 0; i < good.size(); ++i) {
    const bool twin = i + 1 < good.size() && good[i] == good[i + 1];
    hit[i] = random() % 1000 == 0 && !(what == Damage::kDrop && twin);
    new_offset[i] = result.bytes.size();
    if (hit[i] && what == Damage::kDrop) continue;
    result.bytes.push_back(hit[i] && what == Damage::kFlip ? static_cast<std::uint8_t>(good[i] ^ (1 + random() % 255))
                                                           : good[i]);
    if (hit[i] && what == Damage::kInsert) result.bytes.push_back(static_cast<std::uint8_t>(random()));
  }
  for (const DecodedMessage& frame : frames) {
    bool touched = false;
    for (std::uint64_t i = frame.offset; i < frame.offset + frame.length; ++i) {
      const bool behind_the_end = what == Damage::kInsert && i + 1 == frame.offset + frame.length;
      touched = touched || (hit[i] && !behind_the_end);
    }
    if (!touched) result.intact.push_back(new_offset[frame.offset]);
  }
  return result;
}

// frames.md, section 4: on these captures other decoders lose up to one frame in eight.
TEST(Captures, NoIntactFrameIsLostNextToDamagedOnes) {
  PRISM_NEEDS_SHARED("frames/mip_data.bin");
  for (const auto& [file, name] : {std::pair{"mip_data.bin", "microstrain-mip"},
                                   {"xsens_mtdata2_1.bin", "xsens-mtdata2"},
                                   {"xsens_mtdata2_2.bin", "xsens-mtdata2"},
                                   {"ixblue_stdbin_v3.bin", "ixblue-stdbin"}}) {
    const auto description = test::shipped(name);
    const Bytes good = bytes_of(file);
    const auto frames = test::decode(description, good);
    ASSERT_GT(frames.size(), 10u) << file;
    for (const Damage what : {Damage::kFlip, Damage::kDrop, Damage::kInsert}) {
      const Damaged damaged = damage(good, frames, what);
      std::set<std::uint64_t> found;
      for (const DecodedMessage& reading : test::decode(description, damaged.bytes)) found.insert(reading.offset);
      std::size_t lost = 0;
      for (const std::uint64_t offset : damaged.intact) lost += found.contains(offset) ? 0 : 1;
      EXPECT_EQ(lost, 0u) << file << " damage " << static_cast<int>(what) << " of " << damaged.intact.size();
    }
  }
}

}  // namespace
}  // namespace prism::wire
