// SPDX-License-Identifier: MIT
// Computes, compares and stores one check.
#include "drivers/wire/description/check.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <functional>
#include <optional>
#include <string>

#include "drivers/wire/description/field.hpp"

namespace prism::wire {
namespace {

using Bytes = std::span<const std::uint8_t>;

/// First byte of the stored check and the covered bytes; nullopt if the frame is too short.
struct StoredCheck {
  std::size_t at = 0;
  std::size_t size = 0;
  Bytes cover;
};

std::optional<StoredCheck> locate(const CheckRule& rule, Bytes frame) {
  const auto length = static_cast<std::ptrdiff_t>(frame.size());
  std::ptrdiff_t at = rule.at < 0 ? length + rule.at : rule.at;
  std::ptrdiff_t to = rule.to <= 0 ? length + rule.to : rule.to;
  const std::ptrdiff_t from = rule.from < 0 ? length + rule.from : rule.from;
  if (rule.separator != 0) {
    const auto last = std::find(frame.rbegin(), frame.rend(), static_cast<std::uint8_t>(rule.separator));
    if (last == frame.rend()) return std::nullopt;
    at = length - (last - frame.rbegin());
    to = at - 1;
  }
  const bool open_end = rule.stored == CheckRule::Stored::kDecimalText;
  if (at < 0 || from < 0 || to < from || to > length || at + (open_end ? 1 : rule.size) > length) return std::nullopt;
  const std::size_t size = open_end ? static_cast<std::size_t>(length - at) : rule.size;
  return StoredCheck{static_cast<std::size_t>(at), size,
                     frame.subspan(static_cast<std::size_t>(from), static_cast<std::size_t>(to - from))};
}

/// Words of `word` bytes (1, 2 or 4), joined; a last incomplete word counts as if zeros followed.
template <class Join>
std::uint64_t over_words(Bytes bytes, unsigned word, bool big_endian, Join join) {
  std::uint64_t sum = 0;
  for (std::size_t at = 0; at < bytes.size(); at += word) {
    std::uint64_t value = 0;
    for (unsigned i = 0; i < word && at + i < bytes.size(); ++i)
      value |= std::uint64_t{bytes[at + i]} << 8 * (big_endian ? word - 1 - i : i);
    sum = join(sum, value);
  }
  return sum;
}

/// Two 8-bit sums modulo 256: first sum in the high byte, second in the low one.
std::uint64_t fletcher(Bytes bytes) {
  unsigned first = 0, second = 0;
  for (const std::uint8_t byte : bytes) {
    first = (first + byte) & 0xFF;
    second = (second + first) & 0xFF;
  }
  return first << 8 | second;
}

std::uint64_t computed(const CheckRule& rule, Bytes cover) {
  std::uint64_t value = rule.init;
  switch (rule.sum) {
    case CheckRule::Sum::kCrc:
      value = rule.crc->compute(cover, (rule.pad_to - cover.size() % rule.pad_to) % rule.pad_to);
      break;
    case CheckRule::Sum::kSum:
      value += over_words(cover, rule.word, rule.big_endian, std::plus());
      break;
    case CheckRule::Sum::kXor:
      value ^= over_words(cover, rule.word, rule.big_endian, std::bit_xor());
      break;
    case CheckRule::Sum::kFletcher:
      value = fletcher(cover);
      break;
    case CheckRule::Sum::kParity: {
      int ones = 0;
      for (const std::uint8_t byte : cover) ones += std::popcount(byte);
      return ones % 2 == (rule.odd ? 1 : 0) ? 0 : 1;
    }
  }
  return (rule.negate ? std::uint64_t{0} - value : value) & rule.mask;
}

std::uint64_t width_mask(unsigned bytes) {
  return bytes >= 8 ? ~std::uint64_t{0} : (std::uint64_t{1} << 8 * bytes) - 1;
}

bool text_holds(const CheckRule& rule, Bytes stored, std::uint64_t expected) {
  const bool hex = rule.stored == CheckRule::Stored::kHexText;
  const char* first = reinterpret_cast<const char*>(stored.data());
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(first, first + stored.size(), value, hex ? 16 : 10);
  if (error != std::errc{} || value != (expected & width_mask(hex ? rule.size / 2u : rule.size))) return false;
  if (hex) return end == first + stored.size();
  return std::all_of(end, first + stored.size(), [](char c) { return c == '\r' || c == '\n'; });
}

}  // namespace

std::size_t printed_digits(const CheckRule& rule) {
  if (rule.stored == CheckRule::Stored::kHexText) return rule.size;
  return std::to_string(width_mask(rule.size)).size();
}

bool check_holds(const CheckRule& rule, Bytes frame) {
  const std::optional<StoredCheck> stored = locate(rule, frame);
  if (!stored) return false;
  const std::uint64_t expected = computed(rule, stored->cover);
  if (rule.sum == CheckRule::Sum::kParity) return expected == 0;
  const Bytes digits = frame.subspan(stored->at, stored->size);
  if (rule.stored != CheckRule::Stored::kBinary) return text_holds(rule, digits, expected);
  const std::uint64_t value =
      rule.big_endian ? load_big(digits.data(), rule.size) : load_little(digits.data(), rule.size);
  return value == (expected & width_mask(rule.size));
}

void store_check(const CheckRule& rule, std::span<std::uint8_t> frame, bool lower_case) {
  const std::optional<StoredCheck> stored = locate(rule, frame);
  if (!stored) return;
  std::uint64_t value = computed(rule, stored->cover);
  if (rule.stored == CheckRule::Stored::kDecimalText) value &= width_mask(rule.size);
  std::uint8_t* out = frame.data() + stored->at;
  if (rule.sum == CheckRule::Sum::kParity) {
    if (value != 0) *out = static_cast<std::uint8_t>(*out ^ rule.mask);
    return;
  }
  if (rule.stored == CheckRule::Stored::kHexText) {
    for (std::size_t i = stored->size; i-- > 0; value >>= 4)
      out[i] = static_cast<std::uint8_t>((lower_case ? "0123456789abcdef" : "0123456789ABCDEF")[value & 0xF]);
    return;
  }
  if (rule.stored == CheckRule::Stored::kDecimalText) {
    std::size_t digits = stored->size;
    while (digits > 0 && (out[digits - 1] == '\r' || out[digits - 1] == '\n')) --digits;
    for (; digits-- > 0; value /= 10) out[digits] = static_cast<std::uint8_t>('0' + value % 10);
    return;
  }
  for (std::size_t i = 0; i < stored->size; ++i) {
    out[i] = static_cast<std::uint8_t>(value >> 8 * (rule.big_endian ? stored->size - 1 - i : i));
  }
}

}  // namespace prism::wire

// The state is 64 bits wide and left-aligned for every CRC width; reflected input is mirrored bytewise when it is
// loaded. So one algorithm is sufficient: with x the state plus the next eight bytes, the new state is x t^64 mod P, P
// = t^64 + polynomial. Barrett's reduction computes it: q = floor(x m / t^64) with m = floor(t^128 / P), then q P below
// t^64 (Gopal and others, Fast CRC Computation for Generic Polynomials Using PCLMULQDQ, Intel 2009). It is exact,
// because GF(2) has no carries.

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
