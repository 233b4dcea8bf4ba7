// SPDX-License-Identifier: MIT
// The plain checksums of serial protocols: sums of words, XOR, Fletcher.
#pragma once

#include <cstdint>
#include <span>

namespace prism::wire {

/// Sum of words of `word` bytes (1, 2 or 4), not reduced; a last incomplete word counts as if zeros followed.
std::uint64_t word_sum(std::span<const std::uint8_t> bytes, int word, bool big_endian);
/// XOR of words, as word_sum.
std::uint64_t word_xor(std::span<const std::uint8_t> bytes, int word, bool big_endian);
/// Fletcher with two 8-bit sums modulo 256: first sum in the high byte, second in the low one.
std::uint16_t fletcher_256(std::span<const std::uint8_t> bytes);

}  // namespace prism::wire
