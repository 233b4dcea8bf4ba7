// SPDX-License-Identifier: MIT
#include "drivers/wire/crc_tables.hpp"

namespace prism {

// One byte at a time, with the state left-aligned:  s' = T0[top(s) ^ byte] ^ (s << 8).
// Eight at a time: all eight bytes of (s ^ block) leave the state, each through the table that knows how many bytes
// come behind it.
CrcTables::CrcTables(CrcPolynomial polynomial) : reflected_(polynomial.reflected) {
  for (unsigned byte = 0; byte < 256; ++byte) {
    std::uint64_t state = reflected_ ? byte : std::uint64_t{byte} << 56;
    for (int bit = 0; bit < 8; ++bit) {
      const bool carry = reflected_ ? state & 1 : state >> 63;
      state = reflected_ ? state >> 1 : state << 1;
      if (carry) state ^= polynomial.bits;
    }
    table_[0][byte] = state;
  }
  for (std::size_t behind = 1; behind < 8; ++behind) {
    for (unsigned byte = 0; byte < 256; ++byte) {
      const std::uint64_t state = table_[behind - 1][byte];
      table_[behind][byte] =
          reflected_ ? table_[0][state & 0xFF] ^ (state >> 8) : table_[0][state >> 56] ^ (state << 8);
    }
  }
}

std::uint64_t CrcTables::update(std::uint64_t state, std::span<const std::uint8_t> bytes) const {
  const std::uint8_t* at = bytes.data();
  std::size_t left = bytes.size();
  const auto& t = table_;
  if (reflected_) {
    for (; left >= 8; at += 8, left -= 8) {
      const std::uint64_t x = state ^ load_eight(at, true);
      state = t[7][x & 0xFF] ^ t[6][x >> 8 & 0xFF] ^ t[5][x >> 16 & 0xFF] ^ t[4][x >> 24 & 0xFF] ^
              t[3][x >> 32 & 0xFF] ^ t[2][x >> 40 & 0xFF] ^ t[1][x >> 48 & 0xFF] ^ t[0][x >> 56];
    }
    for (; left > 0; ++at, --left) state = t[0][(state ^ *at) & 0xFF] ^ (state >> 8);
    return state;
  }
  for (; left >= 8; at += 8, left -= 8) {
    const std::uint64_t x = state ^ load_eight(at, false);
    state = t[7][x >> 56] ^ t[6][x >> 48 & 0xFF] ^ t[5][x >> 40 & 0xFF] ^ t[4][x >> 32 & 0xFF] ^ t[3][x >> 24 & 0xFF] ^
            t[2][x >> 16 & 0xFF] ^ t[1][x >> 8 & 0xFF] ^ t[0][x & 0xFF];
  }
  for (; left > 0; ++at, --left) state = t[0][(state >> 56) ^ *at] ^ (state << 8);
  return state;
}

}  // namespace prism
