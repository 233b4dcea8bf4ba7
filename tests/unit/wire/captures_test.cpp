// SPDX-License-Identifier: MIT
// Captures of real devices, intact and damaged: every packet decodes, golden values match, no intact frame is lost.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>
#include <sstream>

#include "tests/unit/wire/fixture_files.hpp"

namespace prism::wire {
namespace {

using test::Bytes;
using test::bytes_of;
using test::hex_frames;
using test::values_of;

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
