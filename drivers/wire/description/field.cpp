// SPDX-License-Identifier: MIT
// Writes the bits of one field.
#include "drivers/wire/description/field.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "compensation/sample.hpp"
#include "drivers/wire/description/printed_number.hpp"

namespace prism::wire {
namespace {

/// Limited to the range of the characters.
void store_digits(const Field& field, std::uint8_t* first, double number) {
  const double most = std::pow(10.0, field.size) - 1, least = 1 - std::pow(10.0, field.size - 1);
  const std::string text = fmt::format("{:0{}d}", std::llround(std::clamp(number, least, most)), field.size);
  std::copy(text.begin(), text.end(), first);
}

/// Value of a hexadecimal digit; -1 for another character.
int hex_digit(std::uint8_t c) {
  if (c >= '0' && c <= '9') return c - '0';
  const int lower = c | 0x20;
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

}  // namespace

bool are_hex_digits(const std::uint8_t* first, unsigned size) {
  return std::all_of(first, first + size, [](std::uint8_t c) { return hex_digit(c) >= 0; });
}

std::uint64_t load_hex(const std::uint8_t* first, unsigned size) {
  std::uint64_t value = 0;
  for (unsigned i = 0; i < size; ++i) value = value << 4 | static_cast<unsigned>(hex_digit(first[i]));
  return value;
}

double load_digits(const Field& field, const std::uint8_t* first) {
  return parse_decimal({reinterpret_cast<const char*>(first), field.size}, '.');
}

void store_bits_within(const Field& field, std::uint8_t* first, std::uint64_t value) {
  const std::uint64_t mask = (~std::uint64_t{0} >> (64u - field.bits)) << field.shift;
  std::uint64_t whole = (assembled(field, first) & ~mask) | ((value << field.shift) & mask);
  if (field.plain_big) return store_big(first, field.size, whole);
  if (field.is_hex()) {
    for (unsigned i = field.size; i-- > 0; whole >>= 4)
      first[i] = static_cast<std::uint8_t>("0123456789ABCDEF"[whole & 0xF]);
    return;
  }
  const unsigned low = (1u << field.group_bits) - 1;
  for (unsigned i = field.size; i-- > 0; whole >>= field.group_bits) {
    std::uint8_t& byte = first[field.order[i]];
    byte = static_cast<std::uint8_t>((byte & ~low) | (whole & low));
  }
}

void store_number(const Field& field, std::uint8_t* first, double number) {
  if (!std::isfinite(number)) number = 0;
  if (field.type == NumberType::kDigits) {
    store_digits(field, first, number);
  } else if (field.type == NumberType::kFloat32) {
    store_bits(field, first, std::bit_cast<std::uint32_t>(static_cast<float>(number)));
  } else if (field.type == NumberType::kFloat64) {
    store_bits(field, first, std::bit_cast<std::uint64_t>(number));
  } else if (field.type == NumberType::kSigned) {
    const double limit = std::ldexp(1.0, field.bits - 1);
    const double held =
        std::clamp(std::nearbyint(number), -limit, field.bits == 64 ? 9223372036854774784.0 : limit - 1);
    store_bits(field, first, static_cast<std::uint64_t>(static_cast<std::int64_t>(held)));
  } else {
    const double limit = field.bits == 64 ? 18446744073709549568.0 : std::ldexp(1.0, field.bits) - 1;
    store_bits(field, first, static_cast<std::uint64_t>(std::clamp(std::nearbyint(number), 0.0, limit)));
  }
}

}  // namespace prism::wire
