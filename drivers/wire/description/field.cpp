// SPDX-License-Identifier: MIT
#include "drivers/wire/description/field.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <string_view>

#include "base/text_number.hpp"
#include "compensation/sample.hpp"

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

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// IEC 60751:2008, R(T) = R0 (1 + A T + B T^2 + C (T - 100) T^3), the last term only below 0 degC.
constexpr double kPlatinumA = 3.9083e-3;
constexpr double kPlatinumB = -5.775e-7;
constexpr double kPlatinumC = -4.183e-12;

double interpolate(const std::vector<double>& x, const std::vector<double>& y, double at) {
  const bool rising = x.front() < x.back();
  const double low = rising ? x.front() : x.back();
  const double high = rising ? x.back() : x.front();
  if (!(at >= low && at <= high)) return kNan;
  std::size_t i = 1;
  while (i + 1 < x.size() && (rising ? at > x[i] : at < x[i])) ++i;
  return y[i - 1] + (y[i] - y[i - 1]) * (at - x[i - 1]) / (x[i] - x[i - 1]);
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

// Steps of a conversion chain, forward and inverse.

double platinum_ohm(double t, double r0_ohm) {
  const double below_zero = t < 0 ? kPlatinumC * (t - 100) * t * t * t : 0;
  return r0_ohm * (1 + kPlatinumA * t + kPlatinumB * t * t + below_zero);
}

// Above 0 degC the quadratic has a closed form. Below, Newton starts from it: the error is at most 2.5 degC at -200
// degC, 3e-3 degC after a step, 3e-9 degC after two.
double platinum_degc(double resistance_ohm, double r0_ohm) {
  const double ratio = resistance_ohm / r0_ohm;
  if (!(ratio >= 0.1852 && ratio <= 3.9049)) return kNan;
  double t = (-kPlatinumA + std::sqrt(kPlatinumA * kPlatinumA - 4 * kPlatinumB * (1 - ratio))) / (2 * kPlatinumB);
  if (ratio >= 1) return t;
  for (int step = 0; step < 3; ++step) {
    const double f = 1 + t * (kPlatinumA + t * (kPlatinumB + kPlatinumC * (t - 100) * t)) - ratio;
    const double slope = kPlatinumA + t * (2 * kPlatinumB + kPlatinumC * t * (4 * t - 300));
    t -= f / slope;
  }
  return t;
}

double convert(const ConversionStep& step, double x) {
  switch (step.kind) {
    case ConversionStep::Kind::kTable:
      return interpolate(step.x, step.y, x);
    case ConversionStep::Kind::kBridge:
      return x >= 0 && x < step.full ? step.reference * x / (step.full - x) : kNan;
    case ConversionStep::Kind::kPlatinum:
      break;
  }
  return platinum_degc(x, step.r0_ohm);
}

double convert_back(const ConversionStep& step, double y) {
  switch (step.kind) {
    case ConversionStep::Kind::kTable:
      return interpolate(step.y, step.x, y);
    case ConversionStep::Kind::kBridge:
      return y >= 0 ? step.full * y / (step.reference + y) : kNan;
    case ConversionStep::Kind::kPlatinum:
      break;
  }
  return platinum_ohm(y, step.r0_ohm);
}

double parse_decimal(std::string_view text, char point) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  if (text.starts_with('+')) {
    text.remove_prefix(1);
    if (text.starts_with('+') || text.starts_with('-')) return kUnknown;
  }
  std::array<char, 64> copy;
  if (point != '.') {
    if (text.size() > copy.size() || text.find('.') != std::string_view::npos) return kUnknown;
    std::replace_copy(text.begin(), text.end(), copy.begin(), point, '.');
    text = {copy.data(), text.size()};
  }
  return parse_number<double>(text).value_or(kUnknown);
}

}  // namespace prism::wire
