// SPDX-License-Identifier: MIT
// The state is 64 bits wide and left-aligned for every CRC width; reflected input is mirrored bytewise when it is
// loaded. So one algorithm is sufficient: with x the state plus the next eight bytes, the new state is x t^64 mod P, P
// = t^64 + polynomial. Barrett's reduction computes it: q = floor(x m / t^64) with m = floor(t^128 / P), then q P below
// t^64 (Gopal and others, Fast CRC Computation for Generic Polynomials Using PCLMULQDQ, Intel 2009). It is exact,
// because GF(2) has no carries.
#include "drivers/wire/description/crc.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#ifdef __x86_64__
#include <emmintrin.h>
#endif

namespace prism::wire {
namespace {

struct Product {
  std::uint64_t low, high;
};

Product carryless_product(std::uint64_t a, std::uint64_t b, [[maybe_unused]] bool by_instruction) {
#ifdef __x86_64__
  if (by_instruction) {  // inline assembly: an intrinsic cannot be inlined here, since not every processor has it
    __m128i x = _mm_cvtsi64_si128(static_cast<long long>(a));
    asm("pclmulqdq $0, %1, %0" : "+x"(x) : "x"(_mm_cvtsi64_si128(static_cast<long long>(b))));
    return {static_cast<std::uint64_t>(_mm_cvtsi128_si64(x)),
            static_cast<std::uint64_t>(_mm_cvtsi128_si64(_mm_unpackhi_epi64(x, x)))};
  }
#endif
  Product sum{0, 0};
  for (; b != 0; b &= b - 1) {
    const int bit = std::countr_zero(b);
    sum.low ^= a << bit;
    sum.high ^= a >> 1 >> (63 - bit);
  }
  return sum;
}

/// Mirrors the bits of each byte.
std::uint64_t mirrored_in_bytes(std::uint64_t x) {
  x = (x >> 1 & 0x5555555555555555) | (x & 0x5555555555555555) << 1;
  x = (x >> 2 & 0x3333333333333333) | (x & 0x3333333333333333) << 2;
  return (x >> 4 & 0x0F0F0F0F0F0F0F0F) | (x & 0x0F0F0F0F0F0F0F0F) << 4;
}

/// Fewer than eight bytes as one number, the last one in the lowest bits.
std::uint64_t load(const std::uint8_t* bytes, std::size_t count, bool mirrored) {
  std::uint64_t word = 0;
  for (std::size_t i = 0; i < count; ++i) word = word << 8 | bytes[i];
  return mirrored ? mirrored_in_bytes(word) : word;
}

/// The same for eight bytes in one load.
std::uint64_t load_eight(const std::uint8_t* bytes, bool mirrored) {
  std::uint64_t word = 0;
  std::memcpy(&word, bytes, sizeof word);
  if constexpr (std::endian::native == std::endian::little) word = __builtin_bswap64(word);
  return mirrored ? mirrored_in_bytes(word) : word;
}

}  // namespace

bool has_carryless_product() {
#ifdef __x86_64__
  return __builtin_cpu_supports("pclmul");
#else
  return false;
#endif
}

Crc::Crc(const CrcParameters& parameters, bool by_instruction)
    : parameters_(parameters),
      by_instruction_(by_instruction),
      polynomial_(parameters.poly << (64 - parameters.width)) {
  // Long division of t^128 by P: the leading one leaves the polynomial, then each step gives one bit of the quotient.
  std::uint64_t rest = polynomial_;
  for (int bit = 0; bit < 64; ++bit) {
    const std::uint64_t top = rest >> 63;
    quotient_ = quotient_ << 1 | top;
    rest = rest << 1 ^ top * polynomial_;
  }
}

/// x t^64 mod P.
std::uint64_t Crc::remainder(std::uint64_t x) const {
  const std::uint64_t whole = x ^ carryless_product(x, quotient_, by_instruction_).high;
  return carryless_product(whole, polynomial_, by_instruction_).low;
}

/// The state after the next `bytes` (1 to 8) bytes, which are in the lowest bits of `word`; as many bytes leave the
/// state.
std::uint64_t Crc::push(std::uint64_t state, std::uint64_t word, std::size_t bytes) const {
  if (bytes == 8) return remainder(state ^ word);
  return state << 8 * bytes ^ remainder(state >> (64 - 8 * bytes) ^ word);
}

std::uint64_t Crc::compute(std::span<const std::uint8_t> bytes, std::size_t zeros) const {
  const int width = parameters_.width;
  std::uint64_t state = parameters_.init << (64 - width);
  const std::uint8_t* at = bytes.data();
  std::size_t left = bytes.size();
  for (; left >= 8; at += 8, left -= 8) state = remainder(state ^ load_eight(at, parameters_.reflect_in));
  if (left > 0) state = push(state, load(at, left, parameters_.reflect_in), left);
  for (std::size_t step; zeros > 0; zeros -= step) state = push(state, 0, step = std::min<std::size_t>(zeros, 8));
  const std::uint64_t result =
      parameters_.reflect_out ? mirrored_in_bytes(__builtin_bswap64(state)) : state >> (64 - width);
  return result ^ (parameters_.xor_out & ~std::uint64_t{0} >> (64 - width));
}

}  // namespace prism::wire
