// SPDX-License-Identifier: MIT
// CRC tables and the plain sums.
#include "drivers/wire/checksum.hpp"

#include <bit>
#include <cstring>

namespace prism {
namespace {

std::uint64_t reversed(std::uint64_t value, int width) {
  std::uint64_t result = 0;
  for (int bit = 0; bit < width; ++bit) {
    if (value >> bit & 1) result |= std::uint64_t{1} << (width - 1 - bit);
  }
  return result;
}

std::uint64_t load_eight(const std::uint8_t* bytes) {
  std::uint64_t value;
  std::memcpy(&value, bytes, sizeof value);
  return std::endian::native == std::endian::little ? value : __builtin_bswap64(value);
}

std::uint64_t load_word(const std::uint8_t* bytes, std::size_t available, int word, bool big_endian) {
  std::uint64_t value = 0;
  for (int i = 0; i < word; ++i) {
    const std::uint64_t byte = static_cast<std::size_t>(i) < available ? bytes[i] : 0;
    value |= byte << 8 * (big_endian ? word - 1 - i : i);
  }
  return value;
}

}  // namespace

// One byte at a time, with the state left-aligned:  s' = T0[top(s) ^ byte] ^ (s << 8).
// Eight at a time: all eight bytes of (s ^ block) leave the state, each through the table that knows how many bytes
// come behind it.
Crc::Crc(const CrcParameters& parameters) : parameters_(parameters) {
  const int width = parameters.width;
  mask_ = width == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << width) - 1;
  const bool reflect = parameters.reflect_in;
  const std::uint64_t poly =
      reflect ? reversed(parameters.poly & mask_, width) : (parameters.poly & mask_) << (64 - width);
  start_ = reflect ? reversed(parameters.init & mask_, width) : (parameters.init & mask_) << (64 - width);
  for (unsigned byte = 0; byte < 256; ++byte) {
    std::uint64_t state = reflect ? byte : std::uint64_t{byte} << 56;
    for (int bit = 0; bit < 8; ++bit) {
      const bool carry = reflect ? state & 1 : state >> 63;
      state = reflect ? state >> 1 : state << 1;
      if (carry) state ^= poly;
    }
    table_[0][byte] = state;
  }
  for (std::size_t behind = 1; behind < 8; ++behind) {
    for (unsigned byte = 0; byte < 256; ++byte) {
      const std::uint64_t state = table_[behind - 1][byte];
      table_[behind][byte] = reflect ? table_[0][state & 0xFF] ^ (state >> 8) : table_[0][state >> 56] ^ (state << 8);
    }
  }
}

std::uint64_t Crc::update(std::uint64_t state, std::span<const std::uint8_t> bytes) const {
  const std::uint8_t* at = bytes.data();
  std::size_t left = bytes.size();
  const auto& t = table_;
  if (parameters_.reflect_in) {
    for (; left >= 8; at += 8, left -= 8) {
      const std::uint64_t x = state ^ load_eight(at);
      state = t[7][x & 0xFF] ^ t[6][x >> 8 & 0xFF] ^ t[5][x >> 16 & 0xFF] ^ t[4][x >> 24 & 0xFF] ^
              t[3][x >> 32 & 0xFF] ^ t[2][x >> 40 & 0xFF] ^ t[1][x >> 48 & 0xFF] ^ t[0][x >> 56];
    }
    for (; left > 0; ++at, --left) state = t[0][(state ^ *at) & 0xFF] ^ (state >> 8);
    return state;
  }
  for (; left >= 8; at += 8, left -= 8) {
    const std::uint64_t x = state ^ __builtin_bswap64(load_eight(at));
    state = t[7][x >> 56] ^ t[6][x >> 48 & 0xFF] ^ t[5][x >> 40 & 0xFF] ^ t[4][x >> 32 & 0xFF] ^ t[3][x >> 24 & 0xFF] ^
            t[2][x >> 16 & 0xFF] ^ t[1][x >> 8 & 0xFF] ^ t[0][x & 0xFF];
  }
  for (; left > 0; ++at, --left) state = t[0][(state >> 56) ^ *at] ^ (state << 8);
  return state;
}

std::uint64_t Crc::finish(std::uint64_t state) const {
  const int width = parameters_.width;
  if (!parameters_.reflect_in) state >>= 64 - width;
  if (parameters_.reflect_in != parameters_.reflect_out) state = reversed(state, width);
  return (state ^ parameters_.xor_out) & mask_;
}

std::uint64_t word_sum(std::span<const std::uint8_t> bytes, int word, bool big_endian) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < bytes.size(); i += static_cast<std::size_t>(word)) {
    sum += load_word(bytes.data() + i, bytes.size() - i, word, big_endian);
  }
  return sum;
}

std::uint64_t word_xor(std::span<const std::uint8_t> bytes, int word, bool big_endian) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < bytes.size(); i += static_cast<std::size_t>(word)) {
    sum ^= load_word(bytes.data() + i, bytes.size() - i, word, big_endian);
  }
  return sum;
}

std::uint16_t fletcher_256(std::span<const std::uint8_t> bytes) {
  unsigned first = 0;
  unsigned second = 0;
  for (const std::uint8_t byte : bytes) {
    first = (first + byte) & 0xFF;
    second = (second + first) & 0xFF;
  }
  return static_cast<std::uint16_t>(first << 8 | second);
}

}  // namespace prism
