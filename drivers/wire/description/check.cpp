// SPDX-License-Identifier: MIT
// Computes, compares and stores one check.
#include "drivers/wire/description/check.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <optional>
#include <string>

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

std::uint64_t computed(const CheckRule& rule, Bytes cover) {
  std::uint64_t value = rule.init;
  switch (rule.sum) {
    case CheckRule::Sum::kCrc:
      value = rule.crc->compute(cover, (rule.pad_to - cover.size() % rule.pad_to) % rule.pad_to);
      break;
    case CheckRule::Sum::kSum:
      value += word_sum(cover, rule.word, rule.big_endian);
      break;
    case CheckRule::Sum::kXor:
      value ^= word_xor(cover, rule.word, rule.big_endian);
      break;
    case CheckRule::Sum::kFletcher:
      value = fletcher_256(cover);
      break;
    case CheckRule::Sum::kParity: {
      int ones = 0;
      for (const std::uint8_t byte : cover) ones += std::popcount(byte);
      return ones % 2 == (rule.odd ? 1 : 0) ? 0 : 1;
    }
  }
  return (rule.negate ? std::uint64_t{0} - value : value) & rule.mask;
}

std::uint64_t load_word(const std::uint8_t* bytes, std::size_t available, int word, bool big_endian) {
  std::uint64_t value = 0;
  for (int i = 0; i < word; ++i) {
    const std::uint64_t byte = static_cast<std::size_t>(i) < available ? bytes[i] : 0;
    value |= byte << 8 * (big_endian ? word - 1 - i : i);
  }
  return value;
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
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    value |= std::uint64_t{digits[i]} << 8 * (rule.big_endian ? digits.size() - 1 - i : i);
  }
  return value == (expected & width_mask(rule.size));
}

void store_check(const CheckRule& rule, std::span<std::uint8_t> frame) {
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
      out[i] = static_cast<std::uint8_t>("0123456789ABCDEF"[value & 0xF]);
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

std::uint64_t word_sum(std::span<const std::uint8_t> bytes, int word, bool big_endian) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < bytes.size(); i += static_cast<std::size_t>(word)) {
    sum += load_word(bytes.data() + i, bytes.size() - i, word, big_endian);
  }
  return sum;
}

std::uint64_t word_xor(std::span<const std::uint8_t> bytes, int word, bool big_endian) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < bytes.size(); i += static_cast<std::size_t>(word)) {
    sum ^= load_word(bytes.data() + i, bytes.size() - i, word, big_endian);
  }
  return sum;
}

std::uint16_t fletcher_256(std::span<const std::uint8_t> bytes) {
  unsigned first = 0;
  unsigned second = 0;
  for (const std::uint8_t byte : bytes) {
    first = (first + byte) & 0xFF;
    second = (second + first) & 0xFF;
  }
  return static_cast<std::uint16_t>(first << 8 | second);
}

}  // namespace prism::wire
