// SPDX-License-Identifier: MIT
// From a field's JSON to its compiled form.
#include "drivers/wire/field_reader.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace prism::wire {
namespace {

constexpr int kMaxFrameBytes = 8192;

bool monotonic(const std::vector<double>& v) {
  for (std::size_t i = 1; i < v.size(); ++i) {
    if (!((v[i] > v[i - 1]) == (v[1] > v[0]) && v[i] != v[i - 1])) return false;
  }
  return v.size() >= 2;
}

TableStep read_table(const Section& s) {
  TableStep step{s.numbers("x"), s.numbers("y")};
  const bool rising = monotonic(step.x) && step.x[1] > step.x[0];
  if (!rising || !monotonic(step.y) || step.x.size() != step.y.size()) {
    s.refuse("", "x and y are not two tables of the same length, x rising and y rising or falling");
    step = {{0, 1}, {0, 1}};
  }
  return step;
}

ConversionStep read_step(const Section& s) {
  const std::string step = s.choice("step", {"polynomial", "table", "bridge", "platinum", "thermistor"}, true);
  if (step == "table") return read_table(s);
  if (step == "bridge") return BridgeStep{s.number("full", 1e-9, 1e18), s.number("reference", 1e-9, 1e18)};
  if (step == "platinum") return PlatinumStep{s.number("r0_ohm", 1, 1e5, 100)};
  if (step == "thermistor") {
    return ThermistorStep{s.number("a", -1, 1), s.number("b", -1, 1), s.number("c", -1, 1, 0), s.number("d", -1, 1, 0)};
  }
  return PolynomialStep{s.numbers("coefficients")};
}

void read_order(const Section& s, bool big_endian, Field& field) {
  const bool listed = s.has("order") && s.at("order").is_array();
  const bool big = s.has("order") && !listed ? s.choice("order", {"big", "little"}) == "big" : big_endian;
  for (std::uint8_t i = 0; i < field.size; ++i)
    field.order[i] = static_cast<std::uint8_t>(big ? i : field.size - 1 - i);
  if (listed) {
    unsigned seen = 0;
    const std::vector<std::uint64_t> order = s.bit_list("order");
    for (const std::uint64_t byte : order) seen |= byte < 8 ? 1u << byte : 1u << 31;
    if (order.size() != field.size || seen != (1u << field.size) - 1) {
      s.refuse("order",
               fmt::format("is not an order of the bytes 0 to {}, the most significant first", field.size - 1));
      return;
    }
    for (std::size_t i = 0; i < order.size(); ++i) field.order[i] = static_cast<std::uint8_t>(order[i]);
  }
  const bool whole = field.group_bits == 8;
  field.plain_big = whole && !listed && big;
  field.plain_little = whole && !listed && !big;
}

/// "u16" → unsigned, 16 bits. False where it is none of the types.
bool parse_type(const std::string& type, Field& field) {
  if (type == "decimal" || type == "hex") {
    field.type = type == "hex" ? NumberType::kHexText : NumberType::kDecimalText;
    field.bits = 64;
    return true;
  }
  if (type == "f32" || type == "f64") {
    field.type = type == "f32" ? NumberType::kFloat32 : NumberType::kFloat64;
    field.bits = type == "f32" ? 32 : 64;
    return true;
  }
  if (type.size() < 2 || (type[0] != 'u' && type[0] != 's')) return false;
  field.type = type[0] == 's' ? NumberType::kSigned : NumberType::kUnsigned;
  const char* last = type.data() + type.size();
  const auto [end, error] = std::from_chars(type.data() + 1, last, field.bits);
  return error == std::errc{} && end == last && field.bits >= 1 && field.bits <= 64;
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

void read_number_type(const Section& s, bool big_endian, Field& field) {
  const std::string type = s.text("type");
  if (!parse_type(type, field)) {
    s.refuse("type", fmt::format("\"{}\" is none of u1 to u64, s2 to s64, f32, f64, decimal, hex", type));
    field.bits = 8;
  }
  field.group_bits = static_cast<std::uint8_t>(s.has("group") ? s.whole("group", 7, 8) : 8);
  field.shift = static_cast<std::uint8_t>(s.has("shift") ? s.whole("shift", 0, 63) : 0);
  const int needed = (field.bits + field.shift + field.group_bits - 1) / field.group_bits;
  const bool text = field.type == NumberType::kDecimalText || field.type == NumberType::kHexText;
  const auto size = text ? 1 : s.has("bytes") ? s.whole("bytes", 1, 8) : needed;
  if (!text && (size > 8 || size < needed || size * field.group_bits > 64)) {
    s.refuse("type", fmt::format("{} bits after a shift of {} need {} bytes; expected at most 8 bytes and 64 bits",
                                 field.bits, field.shift, needed));
    field.bits = 8, field.shift = 0, field.size = 1;
  } else {
    field.size = static_cast<std::uint8_t>(size);
  }
  read_order(s, big_endian, field);
}

Scaling read_scaling(const Section& s) {
  Scaling scaling;
  scaling.scale = s.number("scale", -1e18, 1e18, 1);
  if (scaling.scale == 0) s.refuse("scale", "0 makes every value the same; expected another number"), scaling.scale = 1;
  scaling.offset = s.number("offset", -1e18, 1e18, 0);
  scaling.min = s.number("min", -1e300, 1e300, scaling.min);
  scaling.max = s.number("max", -1e300, 1e300, scaling.max);
  if (scaling.min > scaling.max) s.refuse("max", fmt::format("{} is below min {}", scaling.max, scaling.min));
  if (!s.has("convert")) return scaling;
  const Json& steps = s.at("convert");
  if (!steps.is_array()) s.refuse("convert", found(steps) + " is not an array of steps");
  for (std::size_t i = 0; steps.is_array() && i < steps.size(); ++i) {
    scaling.steps.push_back(
        read_step(Section(s.problems(), steps[i], s.pointer(fmt::format("convert/{}", i)), "convert")));
  }
  return scaling;
}

FieldDraft read_field(Problems& problems, const Json& json, const std::string& pointer, const std::string& name,
                      bool big_endian, bool text, int shift_at) {
  const Section s(problems, json, pointer, "field");
  FieldDraft draft;
  draft.pointer = pointer;
  Field& field = draft.field;
  field.name = name;
  read_number_type(s, big_endian, field);
  const bool is_text = field.type == NumberType::kDecimalText || field.type == NumberType::kHexText;
  if (is_text != text)
    s.refuse("type", text ? "is no text type; expected decimal or hex in a text frame"
                          : "is a text type; expected it in a kind with \"text\" only");
  const char* place = text ? "column" : "at";
  field.at = static_cast<int>(s.whole(place, text ? 0 : -kMaxFrameBytes, text ? 63 : kMaxFrameBytes));
  if (s.has(text ? "at" : "column"))
    s.refuse(text ? "at" : "column", fmt::format("is no place in this kind; expected \"{}\"", place));
  if (field.at >= 0) field.at += shift_at;
  if (s.has("item")) draft.item = s.bits("item");
  if (s.has("block")) draft.block = s.bits("block");
  field.unit = s.text("unit", "");
  field.scaling = read_scaling(s);
  field.preset = s.number("preset", -1e18, 1.8446744073709552e19, 0);
  if (s.has("when")) field.when = read_condition(s.sub("when", "when"), draft.when_field);
  return draft;
}

}  // namespace prism::wire
