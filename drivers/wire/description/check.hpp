// SPDX-License-Identifier: MIT
// One check of a frame: over which bytes, how computed, where and how it is stored; and the plain checksums.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "drivers/wire/description/crc.hpp"

namespace prism::wire {

struct CheckRule {
  enum class Sum { kCrc, kSum, kXor, kFletcher, kParity } sum = Sum::kSum;
  enum class Stored { kBinary, kHexText, kDecimalText } stored = Stored::kBinary;

  int from = 0, to = 0;   ///< bytes covered, `to` excluded; negative: from the end of the frame; to 0: the end
  int at = 0;             ///< where it is stored; negative: from the end
  std::uint8_t size = 1;  ///< bytes stored (text: digits; decimal text: up to the end of the frame)
  bool big_endian = true;
  std::uint8_t word = 1;  ///< kSum, kXor: bytes added at a time, in word_big_endian order
  bool word_big_endian = false;
  bool negate = false;                     ///< kSum: the check is what makes the sum 0
  std::uint64_t init = 0;                  ///< kSum, kXor, kFletcher
  std::uint64_t mask = ~std::uint64_t{0};  ///< of the result: 0x7F in the 7-bit family
  std::uint32_t pad_to = 1;                ///< kCrc: zero bytes are thought behind up to a multiple of this
  char separator = 0;                      ///< text: the check stands behind the last one; the cover ends before it ...
  bool covers_separator = false;           ///< ... or behind it
  bool odd = true;                         ///< kParity: ones in the cover, the stored bit among them
  bool in_header = false;                  ///< covers header bytes only: checked before the length is believed
  int bits = 8;                            ///< strength
  std::shared_ptr<const Crc> crc;
};

/// True where the stored check is the computed one; false too where the frame is too short to hold it.
bool check_holds(const CheckRule& rule, std::span<const std::uint8_t> frame);

/// Computes and writes the check. Text checks behind a separator: it must be there.
void store_check(const CheckRule& rule, std::span<std::uint8_t> frame);

/// Sum of words of `word` bytes (1, 2 or 4), not reduced; a last incomplete word counts as if zeros followed.
std::uint64_t word_sum(std::span<const std::uint8_t> bytes, int word, bool big_endian);
/// XOR of words, as word_sum.
std::uint64_t word_xor(std::span<const std::uint8_t> bytes, int word, bool big_endian);
/// Fletcher with two 8-bit sums modulo 256: first sum in the high byte, second in the low one.
std::uint16_t fletcher_256(std::span<const std::uint8_t> bytes);

}  // namespace prism::wire
