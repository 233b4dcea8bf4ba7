// SPDX-License-Identifier: MIT
// Computes, compares and stores one check.
#include "drivers/wire/description/check.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
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

/// Mirrors the bits of each byte.
std::uint64_t mirrored_in_bytes(std::uint64_t x) {
  x = (x >> 1 & 0x5555555555555555) | (x & 0x5555555555555555) << 1;
  x = (x >> 2 & 0x3333333333333333) | (x & 0x3333333333333333) << 2;
  return (x >> 4 & 0x0F0F0F0F0F0F0F0F) | (x & 0x0F0F0F0F0F0F0F0F) << 4;
}

}  // namespace

// The state is 64 bits wide and left-aligned for every CRC width; reflected input is mirrored when it is loaded. So one
// algorithm is sufficient: eight lookups for eight bytes (Kounavis and Berry, A Systematic Approach to Building High
// Performance Software-based CRC Generators, 2005).
Crc::Crc(const CrcParameters& parameters) : parameters_(parameters) {
  const std::uint64_t polynomial = parameters.poly << (64 - parameters.width);
  for (std::uint64_t byte = 0; byte < 256; ++byte) {
    std::uint64_t state = byte << 56;
    for (int bit = 0; bit < 8; ++bit) state = state << 1 ^ (state >> 63) * polynomial;
    remainders_[0][byte] = state;
  }
  for (std::size_t zeros = 1; zeros < remainders_.size(); ++zeros) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint64_t state = remainders_[zeros - 1][byte];
      remainders_[zeros][byte] = state << 8 ^ remainders_[0][state >> 56];
    }
  }
}

std::uint64_t Crc::compute(std::span<const std::uint8_t> bytes, std::size_t zeros) const {
  const int width = parameters_.width;
  const auto load = [&](std::size_t count) {
    const std::uint64_t word = load_big(bytes.data(), static_cast<unsigned>(count));
    bytes = bytes.subspan(count);
    return parameters_.reflect_in ? mirrored_in_bytes(word) : word;
  };
  std::uint64_t state = parameters_.init << (64 - width);
  while (bytes.size() >= 8) {
    const std::uint64_t word = state ^ load(8);
    state = 0;
    for (std::size_t i = 0; i < 8; ++i) state ^= remainders_[i][word >> 8 * i & 0xFF];
  }
  const auto push = [&](std::uint64_t byte) { state = state << 8 ^ remainders_[0][state >> 56 ^ byte]; };
  while (!bytes.empty()) push(load(1));
  for (; zeros > 0; --zeros) push(0);
  const std::uint64_t result =
      parameters_.reflect_out ? mirrored_in_bytes(__builtin_bswap64(state)) : state >> (64 - width);
  return result ^ (parameters_.xor_out & ~std::uint64_t{0} >> (64 - width));
}

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
