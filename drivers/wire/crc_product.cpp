// SPDX-License-Identifier: MIT
#include "drivers/wire/crc_product.hpp"

#ifdef __x86_64__
#include <immintrin.h>
#define PRISM_PRODUCT [[gnu::target("pclmul"), gnu::always_inline]] inline
#endif

namespace prism {

CrcProduct::CrcProduct(CrcPolynomial polynomial) : polynomial_(polynomial.bits), reflected_(polynomial.reflected) {
  // Long division of t^128 by P: the leading one first leaves the polynomial, then one bit of the quotient a step.
  const std::uint64_t divisor = reflected_ ? reversed(polynomial_, 64) : polynomial_;
  std::uint64_t rest = divisor;
  for (int bit = 0; bit < 64; ++bit) {
    const std::uint64_t top = rest >> 63;
    quotient_ = quotient_ << 1 | top;
    rest = rest << 1 ^ (top != 0 ? divisor : 0);
  }
  if (reflected_) quotient_ = reversed(quotient_, 64);
}

#ifdef __x86_64__
namespace {

struct Wide {
  std::uint64_t low, high;
};

PRISM_PRODUCT Wide product(std::uint64_t a, std::uint64_t b) {
  const __m128i wide = _mm_clmulepi64_si128(_mm_cvtsi64_si128(static_cast<long long>(a)),
                                            _mm_cvtsi64_si128(static_cast<long long>(b)), 0);
  return {static_cast<std::uint64_t>(_mm_cvtsi128_si64(wide)),
          static_cast<std::uint64_t>(_mm_cvtsi128_si64(_mm_unpackhi_epi64(wide, wide)))};
}

/// x t^64 mod P.
PRISM_PRODUCT std::uint64_t remainder(std::uint64_t x, std::uint64_t polynomial, std::uint64_t quotient) {
  const std::uint64_t whole = x ^ product(x, quotient).high;
  return product(whole, polynomial).low;
}

/// The same in mirrored bits: the mirrored product of two 64-bit numbers is 127 bits long, one place lower than the
/// product of the mirrored ones.
PRISM_PRODUCT std::uint64_t mirrored_remainder(std::uint64_t x, std::uint64_t polynomial, std::uint64_t quotient) {
  const std::uint64_t whole = x ^ product(x, quotient).low << 1;
  const Wide rest = product(whole, polynomial);
  return rest.high << 1 | rest.low >> 63;
}

}  // namespace

bool CrcProduct::possible() { return __builtin_cpu_supports("pclmul"); }

[[gnu::hot, gnu::target("pclmul")]] std::uint64_t CrcProduct::update(std::uint64_t state,
                                                                     std::span<const std::uint8_t> bytes) const {
  const std::uint8_t* at = bytes.data();
  std::size_t left = bytes.size();
  std::uint64_t word = 0;  // the last bytes, fewer than eight: as many leave the state
  if (reflected_) {
    for (; left >= 8; at += 8, left -= 8) {
      state = mirrored_remainder(state ^ load_eight(at, true), polynomial_, quotient_);
    }
    if (left == 0) return state;
    for (std::size_t i = left; i-- > 0;) word = word << 8 | at[i];
    return state >> 8 * left ^ mirrored_remainder((state ^ word) << (64 - 8 * left), polynomial_, quotient_);
  }
  for (; left >= 8; at += 8, left -= 8) {
    state = remainder(state ^ load_eight(at, false), polynomial_, quotient_);
  }
  if (left == 0) return state;
  for (std::size_t i = 0; i < left; ++i) word = word << 8 | at[i];
  return state << 8 * left ^ remainder(state >> (64 - 8 * left) ^ word, polynomial_, quotient_);
}
#else

bool CrcProduct::possible() { return false; }

std::uint64_t CrcProduct::update(std::uint64_t state, std::span<const std::uint8_t>) const { return state; }
#endif

}  // namespace prism
