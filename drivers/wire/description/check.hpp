// SPDX-License-Identifier: MIT
// One check of a frame: covered bytes, algorithm, position and format.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace prism::wire {

// Cyclic redundancy checks of any width and reflection.

/// The parameters of Ross Williams' model (A Painless Guide to CRC Error Detection Algorithms, 1993).
struct CrcParameters {
  int width = 16;               ///< bits, 3 to 64
  std::uint64_t poly = 0x1021;  ///< without the leading one, not reflected
  std::uint64_t init = 0;
  bool reflect_in = false;
  bool reflect_out = false;
  std::uint64_t xor_out = 0;
};

/// Eight bytes per step, by tables. Immutable and thread-safe.
class Crc {
 public:
  explicit Crc(const CrcParameters& parameters);

  /// CRC of `bytes` followed by `zeros` zero bytes.
  std::uint64_t compute(std::span<const std::uint8_t> bytes, std::size_t zeros = 0) const;
  const CrcParameters& parameters() const { return parameters_; }

 private:
  CrcParameters parameters_;
  std::array<std::array<std::uint64_t, 256>, 8> remainders_;  ///< of a byte, by the number of zero bytes after it
};

struct CheckRule {
  enum class Sum { kCrc, kSum, kXor, kFletcher, kParity } sum = Sum::kSum;
  enum class Stored { kBinary, kHexText, kDecimalText } stored = Stored::kBinary;

  int from = 0, to = 0;   ///< bytes covered, `to` excluded; negative: from the end of the frame; to 0: the end
  int at = 0;             ///< where it is stored; negative: from the end
  std::uint8_t size = 1;  ///< bytes stored (text: digits; decimal text: up to the end of the frame)
  bool big_endian = true;
  std::uint8_t word = 1;                   ///< kSum, kXor: bytes added at a time, in the same order
  bool negate = false;                     ///< kSum: the check is what makes the sum 0
  std::uint64_t init = 0;                  ///< kSum, kXor, kFletcher
  std::uint64_t mask = ~std::uint64_t{0};  ///< of the result: 0x7F in the 7-bit family
  std::uint32_t pad_to = 1;                ///< kCrc: zero bytes appended for the computation up to a multiple of this
  char separator = 0;      ///< text: the check follows the last one, which is not covered; 0: the check is at `at`
  bool odd = true;         ///< kParity: odd number of ones in the covered bytes with the stored bit
  bool in_header = false;  ///< covers header bytes only: checked before the length is used
  int bits = 8;            ///< strength
  std::shared_ptr<const Crc> crc;
};

/// Digits that an encoder writes for a check in text.
std::size_t printed_digits(const CheckRule& rule);

/// Returns true if the stored check is correct; false also if the frame is too short.
bool check_holds(const CheckRule& rule, std::span<const std::uint8_t> frame);

/// Computes and writes the check. Text checks after a separator: it must exist. Decimal text has leading zeros, and a
/// number with more digits than the frame has space for loses the first ones.
void store_check(const CheckRule& rule, std::span<std::uint8_t> frame, bool lower_case = false);

}  // namespace prism::wire
