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

}  // namespace

double load_digits(const Field& field, const std::uint8_t* first) {
  return parse_decimal({reinterpret_cast<const char*>(first), field.size}, '.');
}

void store_bits(const Field& field, std::uint8_t* first, std::uint64_t value) {
  const std::uint64_t mask = (~std::uint64_t{0} >> (64u - field.bits)) << field.shift;
  std::uint64_t whole = (assembled(field, first) & ~mask) | ((value << field.shift) & mask);
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
