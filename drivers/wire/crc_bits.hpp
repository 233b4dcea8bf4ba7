// SPDX-License-Identifier: MIT
// What both ways to a CRC share: how bytes stand in its 64-bit state.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

namespace prism {

/// A CRC's polynomial where its state stands in 64 bits: left-aligned, the highest power at the top; or, for reflected
/// input, right-aligned with the highest power at the bottom. The leading one is not in it.
struct CrcPolynomial {
  std::uint64_t bits = 0;
  bool reflected = false;
};

/// The lowest `width` bits (1 to 64) in the other order; the bits above are dropped.
inline std::uint64_t reversed(std::uint64_t value, int width) {
  std::uint64_t result = 0;
  for (int bit = 0; bit < width; ++bit) result |= (value >> bit & 1) << (width - 1 - bit);
  return result;
}

/// Eight bytes, the first at the bottom (little) or at the top (big).
inline std::uint64_t load_eight(const std::uint8_t* bytes, bool little) {
  std::uint64_t value;
  std::memcpy(&value, bytes, sizeof value);
  return little == (std::endian::native == std::endian::little) ? value : __builtin_bswap64(value);
}

}  // namespace prism
