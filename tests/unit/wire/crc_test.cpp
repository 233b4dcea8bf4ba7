// SPDX-License-Identifier: MIT
// CRCs compared with the check values of the catalogue (the checksum of "123456789") and a bitwise CRC.
#include <gtest/gtest.h>

#include <random>
#include <string_view>
#include <vector>

#include "drivers/wire/description/check.hpp"

namespace prism::wire {
namespace {

std::span<const std::uint8_t> bytes(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

// Greg Cook's catalogue of parametrised CRC algorithms.
TEST(Crc, MatchesTheCatalogue) {
  const auto check = [](const CrcParameters& parameters) { return Crc(parameters).compute(bytes("123456789")); };
  EXPECT_EQ(check({8, 0x07, 0x00, false, false, 0}), 0xF4u) << "CRC-8/SMBUS";
  EXPECT_EQ(check({8, 0x31, 0x00, true, true, 0}), 0xA1u) << "CRC-8/MAXIM-DOW";
  EXPECT_EQ(check({16, 0x1021, 0xFFFF, false, false, 0}), 0x29B1u) << "CRC-16/IBM-3740";
  EXPECT_EQ(check({16, 0x1021, 0x0000, false, false, 0}), 0x31C3u) << "CRC-16/XMODEM";
  EXPECT_EQ(check({16, 0x8005, 0xFFFF, true, true, 0}), 0x4B37u) << "CRC-16/MODBUS";
  EXPECT_EQ(check({12, 0x80F, 0, false, true, 0}), 0xDAFu) << "CRC-12/UMTS: reflected at the end only";
  EXPECT_EQ(check({24, 0x864CFB, 0xB704CE, false, false, 0}), 0x21CF02u) << "CRC-24/OPENPGP";
  EXPECT_EQ(check({32, 0x04C11DB7, 0xFFFFFFFF, true, true, 0xFFFFFFFF}), 0xCBF43926u) << "CRC-32/ISO-HDLC";
  EXPECT_EQ(check({32, 0x04C11DB7, 0xFFFFFFFF, false, false, 0}), 0x0376E6E7u) << "CRC-32/MPEG-2";
  EXPECT_EQ(check({64, 0x42F0E1EBA9EA3693, 0, false, false, 0}), 0x6C40DF5F0B497347u) << "CRC-64/ECMA-182";
}

/// Bit by bit, by the definition.
std::uint64_t slow_crc(const CrcParameters& p, std::span<const std::uint8_t> data) {
  const auto reflect = [](std::uint64_t v, int width) {
    std::uint64_t r = 0;
    for (int i = 0; i < width; ++i) r |= (v >> i & 1) << (width - 1 - i);
    return r;
  };
  const std::uint64_t mask = p.width == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << p.width) - 1;
  std::uint64_t state = p.init & mask;
  for (const std::uint8_t byte : data) {
    const auto in = p.reflect_in ? reflect(byte, 8) : byte;
    for (int bit = 7; bit >= 0; --bit) {
      const bool carry = (state >> (p.width - 1) & 1) != (in >> bit & 1);
      state = (state << 1) & mask;
      if (carry) state ^= p.poly & mask;
    }
  }
  return ((p.reflect_out ? reflect(state, p.width) : state) ^ p.xor_out) & mask;
}

TEST(Crc, MatchesTheDefinitionForEveryWidthReflectionAndLength) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 4 * 62; ++i) {
    const int width = 3 + i / 4;
    const CrcParameters parameters{width, random() | 1, random(), i % 2 == 0, i % 4 < 2, random()};
    const Crc crc(parameters);
    for (std::size_t length = 0; length < 40; ++length) {
      std::vector<std::uint8_t> data(length);
      for (auto& byte : data) byte = static_cast<std::uint8_t>(random());
      ASSERT_EQ(crc.compute(data), slow_crc(parameters, data)) << "width " << width << " length " << length;
    }
  }
}

TEST(Crc, TreatsAppendedZerosAsBytes) {
  std::vector<std::uint8_t> data = {'p', 'r', 'i', 's', 'm'};
  for (const bool reflected : {false, true}) {
    const Crc crc({32, 0x04C11DB7, 0xFFFFFFFF, reflected, reflected, 0});
    for (std::size_t zeros = 0; zeros <= 20; ++zeros) {
      std::vector<std::uint8_t> padded = data;
      padded.resize(data.size() + zeros);
      ASSERT_EQ(crc.compute(data, zeros), crc.compute(padded)) << zeros;
    }
  }
}

}  // namespace
}  // namespace prism::wire
