// SPDX-License-Identifier: MIT
// Compiles a field from its JSON.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "base/json_document.hpp"
#include "base/text_number.hpp"
#include "drivers/wire/description/readers.hpp"

namespace prism::wire {
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
