// SPDX-License-Identifier: MIT
// Checksums of serial protocols: CRC of any width and reflection, sums of words, XOR, Fletcher.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace prism {

/// The parameters of Ross Williams' model (A Painless Guide to CRC Error Detection Algorithms, 1993).
struct CrcParameters {
  int width = 16;               ///< bits, 3 to 64
  std::uint64_t poly = 0x1021;  ///< without the leading one, not reflected
  std::uint64_t init = 0;
  bool reflect_in = false;
  bool reflect_out = false;
  std::uint64_t xor_out = 0;
};

/// Table-driven, eight bytes a step. Immutable: one object serves every thread.
class Crc {
 public:
  explicit Crc(const CrcParameters& parameters);

  std::uint64_t compute(std::span<const std::uint8_t> bytes) const { return finish(update(start(), bytes)); }

  /// In pieces: start, any number of updates, finish.
  std::uint64_t start() const { return start_; }
  std::uint64_t update(std::uint64_t state, std::span<const std::uint8_t> bytes) const;
  std::uint64_t finish(std::uint64_t state) const;

  const CrcParameters& parameters() const { return parameters_; }

 private:
  CrcParameters parameters_;
  std::uint64_t start_ = 0;
  std::uint64_t mask_ = 0;
  /// table_[k][b]: byte b with k zero bytes behind it. The state stands left-aligned in 64 bits (not reflected), or
  /// right-aligned (reflected).
  std::array<std::array<std::uint64_t, 256>, 8> table_{};
};

/// Sum of words of `word` bytes (1, 2 or 4), not reduced; a last incomplete word counts as if zeros followed.
std::uint64_t word_sum(std::span<const std::uint8_t> bytes, int word, bool big_endian);
/// XOR of words, as word_sum.
std::uint64_t word_xor(std::span<const std::uint8_t> bytes, int word, bool big_endian);
/// Fletcher with two 8-bit sums modulo 256: first sum in the high byte, second in the low one.
std::uint16_t fletcher_256(std::span<const std::uint8_t> bytes);

}  // namespace prism
