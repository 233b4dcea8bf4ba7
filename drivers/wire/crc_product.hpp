// SPDX-License-Identifier: MIT
// A CRC by carry-less products: two a step of eight bytes, and no table that has to come from memory.
#pragma once

#include <cstdint>
#include <span>

#include "drivers/wire/crc_bits.hpp"

namespace prism {

/// With x the state and the next eight bytes added, the new state is x t^64 mod P, P = t^64 + polynomial. Barrett's
/// reduction gives it: q = floor(x m / t^64) with m = floor(t^128 / P), then q P below t^64 (Gopal and others, Fast CRC
/// Computation for Generic Polynomials Using PCLMULQDQ, Intel 2009). Exact: over GF(2) nothing is carried.
///
/// A frame that comes every 10 ms finds the caches cold; the tables of 16 KiB cost it 27 lines of memory from far away.
class CrcProduct {
 public:
  explicit CrcProduct(CrcPolynomial polynomial);

  /// Whether this processor can: x86-64 with PCLMULQDQ.
  static bool possible();

  /// Only where possible().
  std::uint64_t update(std::uint64_t state, std::span<const std::uint8_t> bytes) const;

 private:
  std::uint64_t polynomial_;
  std::uint64_t quotient_ = 0;  ///< m without its leading t^64, in the polynomial's order of bits
  bool reflected_;
};

}  // namespace prism
