// SPDX-License-Identifier: MIT
// Writes the bits of one field.
#include "drivers/wire/description/field.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "base/json_document.hpp"
#include "base/text_number.hpp"
#include "compensation/sample.hpp"
#include "drivers/wire/description/readers.hpp"

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

// Steps of a conversion chain, forward and inverse.

namespace {

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

struct Forward {
  double x;
  double operator()(const TableStep& s) const { return interpolate(s.x, s.y, x); }
  double operator()(const BridgeStep& s) const { return x >= 0 && x < s.full ? s.reference * x / (s.full - x) : kNan; }
  double operator()(const PlatinumStep& s) const { return platinum_degc(x, s.r0_ohm); }
};

struct Back {
  double y;
  double operator()(const TableStep& s) const { return interpolate(s.y, s.x, y); }
  double operator()(const BridgeStep& s) const { return y >= 0 ? s.full * y / (s.reference + y) : kNan; }
  double operator()(const PlatinumStep& s) const { return platinum_ohm(y, s.r0_ohm); }
};

}  // namespace

double platinum_ohm(double t, double r0_ohm) {
  const double below_zero = t < 0 ? kPlatinumC * (t - 100) * t * t * t : 0;
  return r0_ohm * (1 + kPlatinumA * t + kPlatinumB * t * t + below_zero);
}

// Above 0 degC the quadratic has a closed form. Below, Newton starts from it: the error is at most 2.5 degC at -200
// degC, and it converges quadratically.
double platinum_degc(double resistance_ohm, double r0_ohm) {
  const double ratio = resistance_ohm / r0_ohm;
  if (!(ratio >= 0.1852 && ratio <= 3.9049)) return kNan;
  double t = (-kPlatinumA + std::sqrt(kPlatinumA * kPlatinumA - 4 * kPlatinumB * (1 - ratio))) / (2 * kPlatinumB);
  if (ratio >= 1) return t;
  for (;;) {
    const double f = 1 + t * (kPlatinumA + t * (kPlatinumB + kPlatinumC * (t - 100) * t)) - ratio;
    const double slope = kPlatinumA + t * (2 * kPlatinumB + kPlatinumC * t * (4 * t - 300));
    const double step = f / slope;
    t -= step;
    if (std::abs(step) < 1e-9) return t;
  }
}

double convert(const ConversionStep& step, double x) { return std::visit(Forward{x}, step); }
double convert_back(const ConversionStep& step, double y) { return std::visit(Back{y}, step); }

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

// Compiles a field from its JSON.

namespace {

bool is_text(const Field& field) {
  return field.type == NumberType::kDecimalText || field.type == NumberType::kHexText;
}

bool monotonic(const std::vector<double>& v) {
  for (std::size_t i = 1; i < v.size(); ++i) {
    if (!((v[i] > v[i - 1]) == (v[1] > v[0]) && v[i] != v[i - 1])) return false;
  }
  return v.size() >= 2;
}

TableStep read_table(const Section& s) {
  TableStep step{s.numbers("x", kAnyNumber), s.numbers("y", kAnyNumber)};
  const bool rising = monotonic(step.x) && step.x[1] > step.x[0];
  if (!rising || !monotonic(step.y) || step.x.size() != step.y.size()) {
    s.fail("", "x and y are not two tables of the same length, x rising and y rising or falling");
    step = {{0, 1}, {0, 1}};
  }
  return step;
}

ConversionStep read_step(const Section& s) {
  s.allow({"x", "y", "full", "reference", "r0_ohm"});
  switch (s.choice("step", {"table", "bridge", "platinum"})) {
    case 1:
      return BridgeStep{s.number("full", {1e-9, 1e18}), s.number("reference", {1e-9, 1e18})};
    case 2:
      return PlatinumStep{s.number("r0_ohm", {1, 1e5}, PlatinumStep{}.r0_ohm)};
    default:
      return read_table(s);
  }
}

void read_order(const Section& s, bool big_endian, Field& field) {
  if (field.is_hex()) {
    if (s.has("order")) s.fail("order", "not valid with hexadecimal digits: the first digit is the most significant");
    return;
  }
  const bool listed = s.is_array("order");
  const bool big = listed ? big_endian : read_byte_order(s, "order", big_endian);
  for (std::uint8_t i = 0; i < field.size; ++i)
    field.order[i] = static_cast<std::uint8_t>(big ? i : field.size - 1 - i);
  if (listed) {
    unsigned seen = 0;
    const std::vector<std::uint64_t> order = s.bit_list("order");
    for (const std::uint64_t byte : order) seen |= 1u << std::min<std::uint64_t>(byte, 31);
    if (order.size() != field.size || seen != (1u << field.size) - 1) {
      s.fail("order", fmt::format("found {}, expected an order of the bytes 0 to {}, the most significant first",
                                  shown(s.any("order")), field.size - 1));
      return;
    }
    for (std::size_t i = 0; i < order.size(); ++i) field.order[i] = static_cast<std::uint8_t>(order[i]);
  }
  const bool whole = field.group_bits == 8;
  field.plain_big = whole && !listed && big;
  field.plain_little = whole && !listed && !big;
}

/// "u16" → unsigned, 16 bits. Returns false for an unknown type.
bool parse_type(const std::string& type, Field& field) {
  if (type == "decimal" || type == "hex") {
    field.type = type == "hex" ? NumberType::kHexText : NumberType::kDecimalText;
    field.bits = 64;
    return true;
  }
  if (type == "digits") {
    field.type = NumberType::kDigits;
    return true;
  }
  if (type == "f32" || type == "f64") {
    field.type = type == "f32" ? NumberType::kFloat32 : NumberType::kFloat64;
    field.bits = type == "f32" ? 32 : 64;
    return true;
  }
  if (type.size() < 2 || (type[0] != 'u' && type[0] != 's')) return false;
  field.type = type[0] == 's' ? NumberType::kSigned : NumberType::kUnsigned;
  field.bits = parse_number<decltype(field.bits)>(std::string_view(type).substr(1)).value_or(0);
  return field.bits >= 1 && field.bits <= 64;
}

Condition read_condition(const Section& s, std::string& field) {
  Condition when;
  field = s.text("field");
  when.modulus = s.bits("modulus", 0);
  when.mask = s.bits("mask", ~std::uint64_t{0});
  const std::vector<std::uint64_t> values = s.bit_list("values");
  when.values.assign(values.begin(), values.end());
  return when;
}

}  // namespace

void read_number_type(const Section& s, bool big_endian, std::int64_t bytes, Field& field) {
  const std::string type = s.text("type");
  if (!parse_type(type, field)) {
    s.fail("type", fmt::format("found {}, expected one of u1 to u64, s2 to s64, f32, f64, digits, decimal, hex",
                               shown(s.any("type"))));
    field.bits = 8;
  }
  if (field.type == NumberType::kDigits) {
    if (bytes == 0) s.fail("bytes", "missing; expected the number of characters");
    if (field.shift != 0 || field.group_bits != 8) s.fail("type", "digits cannot have shift or group");
    field.bits = static_cast<std::uint8_t>(8 * std::max<std::int64_t>(bytes, 1));
    field.shift = 0, field.group_bits = 8;
  }
  const int needed = (field.bits + field.shift + field.group_bits - 1) / field.group_bits;
  const auto size = is_text(field) ? 1 : bytes > 0 ? bytes : needed;
  const int most = field.is_hex() ? 16 : 8;
  if (!is_text(field) && (size > most || size < needed || size * field.group_bits > 64)) {
    s.fail("type", fmt::format("{} bits after a shift of {} need {} bytes; expected at most {} bytes and 64 bits",
                               field.bits, field.shift, needed, most));
    field.bits = 8, field.shift = 0, field.size = 1, field.group_bits = 8;
  } else {
    field.size = static_cast<std::uint8_t>(size);
  }
  read_order(s, big_endian, field);
}

// "250", "2^-24"; nullopt for other texts.
std::optional<double> power_of(std::string_view text) {
  const std::size_t mark = text.find('^');
  const auto base = parse_number<double>(text.substr(0, mark));
  if (mark == std::string_view::npos || !base) return base;
  const auto exponent = parse_number<int>(text.substr(mark + 1));
  return exponent ? std::optional(std::pow(*base, *exponent)) : std::nullopt;
}

// Manuals state scales as "1/16777216", "2^-24", "250/2^23".
std::optional<double> quotient_of(std::string_view text) {
  const std::size_t mark = text.find('/');
  const auto above = power_of(text.substr(0, mark));
  if (mark == std::string_view::npos || !above) return above;
  const auto below = power_of(text.substr(mark + 1));
  return below ? std::optional(*above / *below) : std::nullopt;
}

double read_scale(const Section& s, double otherwise) {
  constexpr Range kRange{-1e18, 1e18};
  if (!s.any("scale").is_string()) return s.number("scale", kRange, otherwise);
  const std::string text = s.text("scale");
  const auto scale = quotient_of(text);
  if (scale && std::abs(*scale) <= kRange.max) return *scale;
  s.fail("scale",
         fmt::format(R"(found "{}", expected a number, or a text such as "1/16777216", "2^-24", "250/2^23")", text));
  return otherwise;
}

Conversion read_scaling(const Section& s) {
  Conversion scaling;
  scaling.scale = read_scale(s, scaling.scale);
  if (scaling.scale == 0) {
    s.fail("scale", "0 makes every value the same; expected another number");
    scaling.scale = 1;
  }
  scaling.offset = s.number("offset", {-1e18, 1e18}, scaling.offset);
  scaling.min = s.number("min", {-1e300, 1e300}, scaling.min);
  scaling.max = s.number("max", {-1e300, 1e300}, scaling.max);
  if (scaling.min > scaling.max) s.fail("max", fmt::format("{} is below min {}", scaling.max, scaling.min));
  for (const Section& step : s.objects("convert", false)) scaling.steps.push_back(read_step(step));
  return scaling;
}

FieldDraft read_field(const Section& s, const std::string& name, bool big_endian, bool text, int shift_at) {
  FieldDraft draft{{}, s, {}, {}, {}};
  Field& field = draft.field;
  field.name = name;
  field.group_bits = static_cast<std::uint8_t>(s.integer("group", {7, 8}, field.group_bits));
  field.shift = static_cast<std::uint8_t>(s.integer("shift", {0, 63}, field.shift));
  const bool hex = s.choice("text", {"no", "hex"}, 0) == 1;
  if (hex && field.group_bits != 8) s.fail("group", "not valid with hexadecimal digits");
  if (hex) field.group_bits = 4;
  read_number_type(s, big_endian, s.has("bytes") ? s.integer("bytes", hex ? Range{1, 16} : Range{1, 8}) : 0, field);
  if (hex && is_text(field))
    s.fail("type", "has no number of bits; expected a type like u16 or s24 with hexadecimal digits");
  if (!hex && is_text(field) != text) {
    s.fail("type", text ? "not a text type; expected decimal or hex in a text frame"
                        : "a text type requires a message type with \"text\"");
  }
  field.decimals = static_cast<int>(s.integer("decimals", {0, 17}, field.decimals));
  if (field.decimals >= 0 && field.type != NumberType::kDecimalText) s.fail("decimals", "only valid with type decimal");
  const char* place = text ? "column" : "at";
  const char* other = text ? "at" : "column";
  const Range range = text ? Range{0, 63} : Range{-kMaxFrameBytes, kMaxFrameBytes};
  field.at = static_cast<int>(s.integer(place, range));
  if (s.has(other)) s.fail(other, fmt::format("not valid in this message type; expected \"{}\"", place));
  if (field.at >= 0) field.at += shift_at;
  if (s.has("item")) draft.item = s.bits("item");
  if (s.has("block")) draft.block = s.bits("block");
  if (hex && (draft.item || draft.block)) s.fail("text", "not valid in an item or block");
  field.unit = s.text("unit", "");
  field.scaling = read_scaling(s);
  field.preset = s.number("preset", {-1e18, 1.8446744073709552e19}, field.preset);
  if (s.has("when")) field.when = read_condition(s.object("when"), draft.when_field);
  return draft;
}

}  // namespace prism::wire
