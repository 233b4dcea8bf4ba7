// SPDX-License-Identifier: MIT
// Cyclic redundancy checks of any width and reflection.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace prism::wire {

/// The parameters of Ross Williams' model (A Painless Guide to CRC Error Detection Algorithms, 1993).
struct CrcParameters {
  int width = 16;               ///< bits, 3 to 64
  std::uint64_t poly = 0x1021;  ///< without the leading one, not reflected
  std::uint64_t init = 0;
  bool reflect_in = false;
  bool reflect_out = false;
  std::uint64_t xor_out = 0;
};

/// Returns true if this processor has carry-less multiplication: x86-64 with PCLMULQDQ.
bool has_carryless_product();

/// Eight bytes per step, by two carry-less products without a table. Processors without the instruction compute the
/// products by shifts: the same result, slower. Immutable and thread-safe.
class Crc {
 public:
  explicit Crc(const CrcParameters& parameters, bool by_instruction = has_carryless_product());

  /// CRC of `bytes` followed by `zeros` zero bytes.
  std::uint64_t compute(std::span<const std::uint8_t> bytes, std::size_t zeros = 0) const;
  const CrcParameters& parameters() const { return parameters_; }

 private:
  std::uint64_t remainder(std::uint64_t x) const;
  std::uint64_t push(std::uint64_t state, std::uint64_t word, std::size_t bytes) const;

  CrcParameters parameters_;
  bool by_instruction_;
  std::uint64_t polynomial_;    ///< left-aligned: the highest power below the leading one at the top
  std::uint64_t quotient_ = 0;  ///< floor(t^128 / P) without its leading t^64
};

}  // namespace prism::wire
