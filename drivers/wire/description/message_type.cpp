// SPDX-License-Identifier: MIT
// The keys of a message type and its fields, and how reliably its frames are recognised.
#include "drivers/wire/description/message_type.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/text_number.hpp"
#include "compensation/sensors.hpp"
#include "drivers/wire/description/frame_view.hpp"
#include "drivers/wire/description/keys.hpp"

namespace prism::wire {
namespace {

constexpr int kSureBits = 32;  // known bits, in one frame or several in a row, required to accept a frame
constexpr int kWeakBits = 16;
constexpr int kMostConfirmations = 16;
constexpr std::uint16_t kMaxBlockBytes = 0xFFFF;
constexpr std::uint32_t kEarlyBytes = 8;                   // a check that ends within them can belong to the header
constexpr Range kOffset{-kMaxFrameBytes, kMaxFrameBytes};  // of a byte, from the start or the end
constexpr Range kStart{0, kMaxFrameBytes}, kLength{1, kMaxFrameBytes}, kEarly{0, 255};
constexpr std::array kByteOrders = {"big", "little"};
constexpr std::array kDigits = {"no", "hex"};

// The byte order of a field, length, item or check: its own, or else the description's.
bool read_byte_order(const Section& s) {
  const std::size_t usual = s.top().choice("order", kByteOrders, 0);
  return s.choice("order", kByteOrders, usual) == 0;
}

// Numbers.

bool monotonic(const std::vector<double>& v) {
  for (std::size_t i = 1; i < v.size(); ++i) {
    if (!((v[i] > v[i - 1]) == (v[1] > v[0]) && v[i] != v[i - 1])) return false;
  }
  return v.size() >= 2;
}

JsonTable<ConversionStep> conversion_keys() {
  using S = ConversionStep;
  static constexpr std::array kSteps = {"table", "bridge", "platinum"};
  return JsonTable<S>()
      .choice("step", kSteps, &S::kind, kRequired)
      .numbers("x", kAnyNumber, &S::x, "table: rising")
      .numbers("y", kAnyNumber, &S::y, "table: as many values, rising or falling")
      .number("full", {1e-9, 1e18}, &S::full, "bridge: x / (full - x) * reference")
      .number("reference", {1e-9, 1e18}, &S::reference, "")
      .number("r0_ohm", {1, 1e5}, &S::r0_ohm, "platinum: ohm to degC, IEC 60751")
      .then([](const Section& s, S& step) {
        if (step.kind == S::Kind::kBridge) s.require("full"), s.require("reference");
        if (step.kind != S::Kind::kTable) return;
        s.require("x"), s.require("y");
        const std::vector<double>&x = step.x, &y = step.y;
        if (!monotonic(x) || x[1] < x[0] || !monotonic(y) || x.size() != y.size())
          s.fail("", "x and y are not two tables of the same length, x rising and y rising or falling");
      });
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

constexpr Range kFactor{-1e18, 1e18}, kLimit{-1e300, 1e300};

double read_scale(const Section& s, const std::string& key) {
  const bool is_text = s.any(key).is_string();
  const std::string text = is_text ? s.text(key) : "";
  const double scale = is_text ? quotient_of(text).value_or(kUnknown) : s.number(key, kFactor);
  if (!(std::abs(scale) <= kFactor.max))
    s.fail(key,
           fmt::format(R"(found "{}", expected a number, or a text such as "1/16777216", "2^-24", "250/2^23")", text));
  if (scale == 0) s.fail(key, "0 makes every value the same; expected another number");
  return scale;
}

}  // namespace

const JsonTable<Conversion>& scaling_keys() {
  using C = Conversion;
  const Json text = {{"type", "string"}, {"pattern", "^[-.0-9eE]+(\\^-?[0-9]+)?(/[-.0-9eE]+(\\^-?[0-9]+)?)?$"}};
  const Json scale = {{"anyOf", {limits_schema("number", kFactor), text}}};
  const auto known = [](double limit) { return std::abs(limit) < kLimit.max ? Json(limit) : Json(); };
  const auto read_limit = [](const Section& s, const std::string& key) { return s.number(key, kLimit); };
  const Json limit = limits_schema("number", kLimit);
  static const JsonTable<C> keys =
      JsonTable<C>()
          .value(
              "scale", scale, &C::scale,
              "value = raw * scale + offset, then the steps of convert; not 0; as text: 1/16777216, 2^-24, 250/2^23",
              [](const Section& s, const std::string& key) { return read_scale(s, key); },
              [](double stored) { return Json(stored); })
          .number("offset", kFactor, &C::offset, "")
          .value("min", limit, &C::min, "outside min to max the value is unknown", read_limit, known)
          .value("max", limit, &C::max, "", read_limit, known)
          .then([](const Section& s, C& scaling) {
            if (scaling.min > scaling.max) s.fail("max", fmt::format("{} is below min {}", scaling.max, scaling.min));
          })
          .objects(
              JsonTable<C>::Form::kList, "convert", conversion_keys(),
              [](const Section&, const std::string&, const ConversionStep& step, C& scaling) {
                scaling.steps.push_back(step);
              },
              "steps from the scaled number to the quantity, in order");
  return keys;
}

namespace {

bool is_text(const Field& field) {
  return field.type == NumberType::kDecimalText || field.type == NumberType::kHexText;
}

void read_order(const Section& s, Field& field) {
  if (field.is_hex()) {
    if (s.has("order")) s.fail("order", "not valid with hexadecimal digits: the first digit is the most significant");
    return;
  }
  const bool listed = s.is_array("order");
  const bool big = listed || read_byte_order(s);
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

// "u16" → unsigned, 16 bits. Returns false for an unknown type.
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

// Type, size and byte order of a field whose grouping and shift are known; `bytes`: 0: as many as the type needs.
void read_number_type(const Section& s, std::int64_t bytes, Field& field) {
  if (!parse_type(s.text("type"), field)) {
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
  read_order(s, field);
}

template <class T, class Read>
void add_type(JsonTable<T>& keys, Read read_type) {
  const Json named = {{"type", "string"}, {"enum", kByteOrders}};
  const Json listed = {{"type", "array"}, {"minItems", 1}, {"maxItems", 8}, {"items", unsigned_schema()}};
  keys.known("order", {{"anyOf", {named, listed}}},
             "big, little, or the bytes' offsets with the most significant first; default: the description's")
      .custom("type", {{"type", "string"}, {"pattern", "^([us]([1-9]|[1-5][0-9]|6[0-4])|f32|f64|digits|decimal|hex)$"}},
              "u1 to u64, s2 to s64, f32, f64; digits: a number printed in \"bytes\" characters; text frames: decimal, "
              "hex",
              read_type, nullptr);
}

JsonTable<ConditionDraft> condition_keys() {
  using C = ConditionDraft;
  return JsonTable<C>()
      .text("field", &C::field, kRequired)
      .bits("modulus", &C::modulus, "")
      .bits("mask", &C::mask, "")
      .bit_list("values", &C::values, kRequired);
}

JsonTable<Field> number_keys() {
  JsonTable<Field> keys;
  keys.integer("group", {7, 8}, &Field::group_bits, "payload bits of a byte")
      .integer("shift", {0, 63}, &Field::shift, "low bits that are dropped")
      .custom(
          "text", {{"type", "string"}, {"enum", kDigits}},
          "hex: the number is printed in hexadecimal digits, as many as its bits need; s8 to s64 in two's complement",
          [](const Section& s, Field& field) {
            if (s.choice("text", kDigits, 0) == 0) return;
            if (field.group_bits != 8) s.fail("group", "not valid with hexadecimal digits");
            field.group_bits = 4;
          },
          nullptr)
      .known("bytes", limits_schema("integer", {1, 16}),
             "default: as many as the bits need; at most 8, or 16 hexadecimal digits");
  add_type(keys, [](const Section& s, Field& field) {
    const Range most = field.is_hex() ? Range{1, 16} : Range{1, 8};
    read_number_type(s, s.has("bytes") ? s.integer("bytes", most) : 0, field);
    if (field.is_hex() && is_text(field))
      s.fail("type", "has no number of bits; expected a type like u16 or s24 with hexadecimal digits");
  });
  const auto scaling = [](auto& field) -> auto& { return field.scaling; };
  return keys.also({}, true)
      .integer("decimals", {0, 17}, &Field::decimals,
               "type decimal: exact number of digits after the point; other frames are rejected")
      .then([](const Section& s, Field& field) {
        if (field.decimals >= 0 && field.type != NumberType::kDecimalText)
          s.fail("decimals", "only valid with type decimal");
      })
      .text("unit", &Field::unit, "")
      .group(scaling_keys(), scaling)
      .number("preset", {-1e18, 1.8446744073709552e19}, &Field::preset, "raw number that an encoder writes by default");
}

void set_field_place(const Section& s, const FieldDraft& draft, int shift_at, MessageType& kind, Field& field) {
  const bool text = kind.structure == Structure::kColumns;
  const char* place = text ? "column" : "at";
  const char* other = text ? "at" : "column";
  s.require(place);
  if (s.has(other)) s.fail(other, fmt::format("not valid in this message type; expected \"{}\"", place));
  field.at = (text ? draft.column : draft.at).value_or(0);
  if (field.at >= 0) field.at += shift_at;
  if (field.is_hex() && (draft.item || draft.block)) s.fail("text", "not valid in an item or block");
  if (draft.item && draft.block) s.fail("", "is in an item and in a block; expected one of them");
  if (draft.item) {
    if (kind.structure != Structure::kItems) s.fail("item", "this message type has no \"items\"");
    auto& ids = kind.items.ids;
    const auto at = std::find(ids.begin(), ids.end(), *draft.item);
    field.item = static_cast<int>(at - ids.begin());
    if (at == ids.end()) ids.push_back(*draft.item);
    if (ids.size() > FrameView::kMaxElements) {
      s.fail("", fmt::format("too many items; expected at most {}", FrameView::kMaxElements));
      ids.pop_back();
    }
  }
  if (draft.block) {
    field.item = static_cast<int>(std::min<std::uint64_t>(*draft.block, FrameView::kMaxElements - 1));
    const std::size_t blocks = kind.blocks.sizes.size();
    if (*draft.block >= blocks)
      s.fail("block", fmt::format("found block {}, but this message type has {} blocks", *draft.block, blocks));
  }
}

}  // namespace

const JsonTable<FieldDraft>& field_keys() {
  using F = FieldDraft;
  static const JsonTable<F> keys =
      JsonTable<F>()
          .group(number_keys(), &F::field)
          .integer("at", kOffset, &F::at,
                   "first byte; negative: from the end; in an item or block: from its first byte")
          .integer("column", {0, 63}, &F::column, "text frames")
          .bits("item", &F::item, "the item that has it")
          .bits("block", &F::block, "the block that has it")
          .object(
              "when", condition_keys(), &F::when,
              "the field is present if (other field % modulus) & mask is one of the values; the other is before it");
  return keys;
}

namespace {

void place_field(const Section& s, const std::string& name, const FieldDraft& draft, int shift_at, MessageType& kind) {
  Field field = draft.field;
  field.name = name;
  if (!field.is_hex() && is_text(field) != (kind.structure == Structure::kColumns))
    s.fail("type", is_text(field) ? "a text type requires a message type with \"text\""
                                  : "not a text type; expected decimal or hex in a text frame");
  set_field_place(s, draft, shift_at, kind, field);
  if (kind.field_index(name) >= 0) s.fail("", "this message type already has a field of that name");
  if (draft.when) {
    const ConditionDraft& when = *draft.when;
    field.when = {kind.field_index(when.field), when.modulus, when.mask, {}};
    field.when.values.assign(when.values.begin(), when.values.end());
    if (field.when.field < 0) s.fail("when/field", fmt::format("no field \"{}\" before this one", when.field));
  }
  kind.fields.push_back(std::move(field));
}

void read_fields(const Section& fields, int at, MessageType& kind) {
  for (const std::string& name : fields.names(TextRule::kMessageName)) {
    FieldDraft draft;
    const Section s = fields.object(name);
    field_keys().read(s, draft);
    place_field(s, name, draft, at, kind);
  }
}

// Structure.

struct SyncDraft {
  std::uint32_t at = 0;
  std::vector<std::uint8_t> bytes, mask;
};

JsonTable<SyncDraft> sync_keys() {
  using S = SyncDraft;
  return JsonTable<S>()
      .integer("at", kEarly, &S::at, "")
      .bytes("bytes", &S::bytes, kRequired)
      .bytes("mask", &S::mask, "which bits count; as many bytes as in bytes");
}

void add_sync(const Section& s, const std::string&, SyncDraft& sync, MessageType& kind) {
  if (sync.mask.empty()) sync.mask.assign(sync.bytes.size(), 0xFF);
  if (sync.mask.size() != sync.bytes.size())
    return s.fail("mask",
                  fmt::format("found {} bytes; expected {} as in \"bytes\"", sync.mask.size(), sync.bytes.size()));
  for (std::uint32_t i = 0; i < sync.bytes.size(); ++i) {
    if (sync.mask[i] == 0) continue;
    kind.sync.push_back({sync.at + i, static_cast<std::uint8_t>(sync.bytes[i] & sync.mask[i]), sync.mask[i]});
  }
}

JsonTable<LengthRule> length_keys() {
  using L = LengthRule;
  const auto at = [](auto& length) -> auto& { return length.field.at; };
  JsonTable<L> keys;
  keys.integer("min", kLength, &L::min, "")
      .integer("max", kLength, &L::max, kRequired)
      .then([](const Section& s, L& length) {
        if (length.min > length.max) s.fail("max", fmt::format("{} is below min {}", length.max, length.min));
      })
      .bytes("terminator", &L::terminator, "the frame's last bytes: CR LF")
      .integer("at", kEarly, at, "position of the length field")
      .integer("add", {-1024, 1024}, &L::add, "length = field + add");
  add_type(keys, [](const Section& s, L& length) {
    length.form = s.has("terminator") ? L::LengthType::kTerminated : L::LengthType::kField;
    s.has("type");
    if (length.form == L::LengthType::kTerminated) return;
    s.require("at");
    read_number_type(s, 0, length.field);
  });
  return keys;
}

void read_length(const Section& s, MessageType& kind) {
  LengthRule& length = kind.length;
  if (s.is_object("length")) {
    length.min = 1;
    return length_keys().read(s.object("length"), length);
  }
  length.min = length.max = static_cast<std::uint32_t>(s.integer("length", kLength));
}

Json length_schema() {
  LengthRule usual;
  usual.min = 1;
  return {{"anyOf", {limits_schema("integer", kLength), length_keys().schema(usual)}}};
}

JsonTable<ItemRule> item_keys() {
  using I = ItemRule;
  return JsonTable<I>()
      .integer("from", kStart, &I::from, kRequired)
      .integer("to", {-kMaxFrameBytes, 0}, &I::to, "")
      .integer("id_size", {1, 4}, &I::id_size, "")
      .integer("length_size", {1, 2}, &I::length_size, "")
      .boolean("length_first", &I::length_first, "")
      .boolean("length_includes_header", &I::length_includes_header, "")
      .custom(
          "order", {{"type", "string"}, {"enum", kByteOrders}}, "default: the description's",
          [](const Section& s, I& items) { items.big_endian = read_byte_order(s); }, nullptr)
      .bit_list("send", &I::sent, "ids that an encoder writes");
}

JsonTable<ColumnsRule> text_keys() {
  using C = ColumnsRule;
  return JsonTable<C>()
      .raw_text("separators", &C::separators, {kRequired, "the characters between two columns: \",;\\t\""})
      .boolean("collapse", &C::collapse, "runs of separators count as one")
      .integer("columns", {0, FrameView::kMaxElements}, &C::columns, "exact number; 0: any")
      .value(
          "decimal_comma", {{"type", "boolean"}}, &C::point, "numbers have a decimal comma",
          [](const Section& s, const std::string& key) { return s.boolean(key) ? ',' : '.'; },
          [](char point) { return Json(point == ','); })
      .raw_text("write", &C::write, "template for an encoder: {field} or {field:9.6f}")
      .then([](const Section& s, C& text) {
        if (const std::string problem = separators_problem(text.separators); !problem.empty())
          s.fail("separators", problem);
        if (text.separators.find(text.point) != std::string::npos)
          s.fail("separators", fmt::format("contains '{}', which can occur in numbers", text.point));
      });
}

JsonTable<BlockRule> block_keys() {
  using B = BlockRule;
  return JsonTable<B>()
      .known("mask", {{"type", "string"}}, {kRequiredByCheck, "the field whose bits select the blocks"})
      .integer("from", kStart, &B::from, kRequired)
      .value(
          "sizes",
          {{"type", "array"},
           {"minItems", 1},
           {"maxItems", FrameView::kMaxElements},
           {"items", limits_schema("integer", {0, kMaxBlockBytes})}},
          &B::sizes, kRequired,
          [](const Section& s, const std::string& key) {
            std::vector<std::uint32_t> sizes;
            for (const std::uint64_t bytes : s.bit_list(key)) {
              if (bytes > kMaxBlockBytes)
                s.fail(key, fmt::format("found {}, expected at most {} bytes", bytes, kMaxBlockBytes));
              sizes.push_back(static_cast<std::uint32_t>(bytes));
            }
            if (sizes.size() > FrameView::kMaxElements)
              s.fail(key, fmt::format("has more than {} blocks", FrameView::kMaxElements));
            return sizes;
          },
          [](const auto&) { return Json(); });
}

struct LayoutDraft {
  int at = 0;
  std::vector<std::string> parts;
};

JsonTable<LayoutDraft> layout_keys() {
  using L = LayoutDraft;
  return JsonTable<L>().integer("at", kEarly, &L::at, "").texts("parts", &L::parts, kRequired);
}

void add_layout(const Section& s, const std::string&, const LayoutDraft& layout, MessageType& kind) {
  const Section parts = s.top().object("parts");
  int at = layout.at;
  for (const std::string& name : layout.parts) {
    if (!parts.has(name)) {
      s.fail("parts", fmt::format("\"{}\" is not in the description's parts", name));
      continue;
    }
    const Section part = parts.object(name);
    read_fields(part.object("fields", true), at, kind);
    at += static_cast<int>(part.integer("size", kLength));
  }
}

void set_structure(const Section& s, MessageType& kind) {
  if (s.has("text") + s.has("items") + s.has("blocks") > 1)
    s.fail("", "has more than one of \"text\", \"items\", \"blocks\"; expected at most one");
  if (s.has("text")) kind.structure = Structure::kColumns;
  if (s.has("items")) kind.structure = Structure::kItems;
  if (s.has("blocks")) kind.structure = Structure::kBlocks;
  if (kind.structure == Structure::kColumns && kind.length.form != LengthRule::LengthType::kTerminated)
    s.fail("text", "needs a length with a terminator");
}

// Checks.

struct CheckDraft {
  CheckRule rule;
  CrcParameters crc;
  std::string mark;
};

JsonTable<CrcParameters> crc_keys() {
  using C = CrcParameters;
  return JsonTable<C>()
      .integer("width", {3, 64}, &C::width, "crc: bits")
      .bits("poly", &C::poly, "")
      .boolean("reflect_in", &C::reflect_in, "")
      .custom(
          "reflect_out", {{"type", "boolean"}}, "default: as reflect_in",
          [](const Section& s, C& crc) { crc.reflect_out = s.boolean("reflect_out", crc.reflect_in); }, nullptr)
      .bits("xor_out", &C::xor_out, "");
}

void compile_check(const Section& s, CheckDraft& draft) {
  CheckRule& rule = draft.rule;
  if (rule.word == 3) s.fail("word", "found 3, expected 1, 2 or 4");
  if (rule.sum == CheckRule::Sum::kCrc) {
    s.require("width"), s.require("poly");
    draft.crc.init = rule.init;
    rule.crc = std::make_shared<const Crc>(draft.crc);
    rule.bits = draft.crc.width;
  }
  if (!s.has("size"))
    rule.size = static_cast<std::uint8_t>(rule.sum == CheckRule::Sum::kCrc        ? (draft.crc.width + 7) / 8
                                          : rule.sum == CheckRule::Sum::kFletcher ? 2
                                                                                  : rule.word);
  if (rule.sum != CheckRule::Sum::kCrc) rule.bits = std::min(8 * rule.size, std::popcount(rule.mask));
  if (rule.sum == CheckRule::Sum::kParity) {
    rule.bits = 1;
    if (std::popcount(rule.mask) != 1 || rule.mask > 0xFF) s.fail("mask", "is not one bit of the byte at \"at\"");
  }
  if (rule.stored != CheckRule::Stored::kBinary) {
    if (s.has("mark") && draft.mark.size() != 1)
      s.fail("mark", "not one character; expected the character before the check");
    else if (s.has("mark"))
      rule.separator = draft.mark[0];
    if (rule.stored == CheckRule::Stored::kHexText) rule.size = static_cast<std::uint8_t>(2 * rule.size);
  }
  if (rule.separator == 0) s.require("at");
}

JsonTable<CheckDraft> check_keys() {
  using R = CheckRule;
  static constexpr std::array kSums = {"crc", "sum", "xor", "fletcher", "parity"};
  static constexpr std::array kStored = {"no", "hex", "decimal"};
  const JsonTable<R> first = JsonTable<R>()
                                 .choice("kind", kSums, &R::sum, kRequired)
                                 .integer("from", kOffset, &R::from, "first byte covered; negative: from the end")
                                 .integer("to", kOffset, &R::to, "first byte not covered; 0: the end")
                                 .custom(
                                     "order", {{"type", "string"}, {"enum", kByteOrders}},
                                     "byte order of the stored check; default: the description's",
                                     [](const Section& s, R& rule) { rule.big_endian = read_byte_order(s); }, nullptr)
                                 .integer("word", {1, 4}, &R::word, "sum, xor: bytes added at a time: 1, 2 or 4")
                                 .boolean("negate", &R::negate, "sum: the check makes the sum 0")
                                 .bits("init", &R::init, "");
  const JsonTable<R> last = JsonTable<R>()
                                .integer("pad_to", {1, 64}, &R::pad_to,
                                         "crc: zero bytes appended (for the computation) up to a multiple of this")
                                .integer("size", {1, 8}, &R::size, "bytes stored")
                                .bits("mask", &R::mask, "of the result; parity: its bit")
                                .boolean("odd", &R::odd, "parity")
                                .choice("text", kStored, &R::stored, "stored as digits")
                                .integer("at", kOffset, &R::at, "where it is stored");
  return JsonTable<CheckDraft>()
      .group(first, &CheckDraft::rule)
      .group(crc_keys(), &CheckDraft::crc)
      .group(last, &CheckDraft::rule)
      .raw_text("mark", &CheckDraft::mark, "text: the character before the check; without it the check is at \"at\"")
      .then(compile_check);
}

JsonTable<BodyRule> body_keys() {
  using B = BodyRule;
  return JsonTable<B>()
      .integer("from", kOffset, &B::from, "")
      .integer("to", kOffset, &B::to, "")
      .bits("mask", &B::mask, kRequired)
      .bits("value", &B::value, "");
}

void add_refusal(const Section& s, const std::string&, const BitsDraft& bits, MessageType& kind) {
  kind.rejects.push_back({kind.field_index(bits.field), bits.mask, bits.value});
  if (kind.rejects.back().field < 0) s.fail("field", "this message type has no such field");
}

// The columns end before the terminator, or before a check without a mark.
void measure_tail(MessageType& kind) {
  auto tail = static_cast<int>(kind.length.terminator.size());
  for (const CheckRule& check : kind.checks) {
    if (check.separator == 0) tail = std::max(tail, -check.at);
  }
  kind.text.tail = static_cast<std::uint32_t>(tail);
}

// Sorts the sync, finds the header's checks and the bytes they need.
void measure_header(MessageType& kind) {
  std::sort(kind.sync.begin(), kind.sync.end(), [](const ByteRule& a, const ByteRule& b) { return a.at < b.at; });
  std::uint32_t& header = kind.header_bytes;
  for (const ByteRule& rule : kind.sync) header = std::max(header, rule.at + 1);
  if (kind.length.form != LengthRule::LengthType::kField) return;
  header = std::max(header, static_cast<std::uint32_t>(kind.length.field.at) + kind.length.field.size);
  for (CheckRule& check : kind.checks) {
    const auto to = static_cast<std::uint32_t>(check.to), at = static_cast<std::uint32_t>(check.at);
    check.in_header = check.from >= 0 && check.to > 0 && check.at >= 0 && check.separator == 0 && to <= kEarlyBytes &&
                      at < kEarlyBytes;
    if (check.in_header) header = std::max({header, to, at + check.size});
  }
}

// Text must be parsable; body rules fix bits of each byte they cover. Neither is a check: at most 16 bits are counted.
int body_bits(const MessageType& kind) {
  const auto length = static_cast<int>(kind.length.min);
  int bits = kind.structure == Structure::kColumns ? 8 * length : 0;
  for (const BodyRule& rule : kind.body) {
    const int from = rule.from < 0 ? length + rule.from : rule.from;
    const int to = rule.to <= 0 ? length + rule.to : std::min(rule.to, length);
    bits += std::popcount(rule.mask) * std::max(to - from, 0);
  }
  return std::min(bits, 16);
}

// Computes the number of bits that identify a frame, and how many good frames in a row confirm a weak message type.
void measure_strength(MessageType& kind) {
  for (const CheckRule& check : kind.checks) kind.check_bits += check.bits;
  kind.known_bits = kind.check_bits + 8 * static_cast<int>(kind.length.terminator.size());
  for (const ByteRule& rule : kind.sync) kind.known_bits += std::popcount(rule.mask);
  kind.known_bits += body_bits(kind);
  kind.weak = kind.known_bits < kWeakBits;
  const int frames = (kSureBits - 1 + kind.known_bits) / std::max(kind.known_bits, 1);
  if (kind.check_bits < kWeakBits) kind.confirmations = std::clamp(frames, 2, kMostConfirmations);
}

void measure(const Section&, MessageType& kind) {
  for (Field& field : kind.fields)
    field.is_direct = kind.structure == Structure::kPlain && field.when.field < 0 && field.at >= 0 && !field.is_hex();
  measure_tail(kind);
  measure_header(kind);
  measure_strength(kind);
}

}  // namespace

JsonTable<BitsDraft> bits_keys(bool value_is_required, bool mask_is_required) {
  JsonTable<BitsDraft> keys;
  keys.text("field", &BitsDraft::field, kRequired)
      .bits("mask", &BitsDraft::mask, mask_is_required ? KeyHelp(kRequired) : KeyHelp(""));
  if (value_is_required) keys.bits("value", &BitsDraft::value, kRequired);
  return keys;
}

JsonTable<int> part_keys() {
  return JsonTable<int>()
      .integer("size", kLength, std::identity(), {kRequired, "bytes"})
      .known("fields", {{"type", "object"}, {"additionalProperties", field_keys().schema()}},
             "positions count from the part's first byte")  // read at the positions set by a message type's layout
      .also({}, true);
}

const JsonTable<MessageType>& message_keys() {
  using M = MessageType;
  using Form = JsonTable<M>::Form;
  static const JsonTable<M> keys =
      JsonTable<M>()
          .text("name", &M::name, kRequired, TextRule::kMessageName)
          .objects(Form::kOneOrMore, "sync", sync_keys(), add_sync, "constant bytes")
          .value(
              "after", {{"type", "string"}, {"pattern", "^ *[0-9a-fA-F]{2} *$"}}, &M::after,
              "the byte that must precede the frame",
              [](const Section& s, const std::string& key) {
                const std::vector<std::uint8_t> after = s.bytes(key);
                if (after.size() > 1) s.fail(key, "has more than one byte");
                return after.empty() ? -1 : after[0];
              },
              [](int) { return Json(); })
          .custom("length", length_schema(), "length of the frame in bytes", read_length, nullptr)
          .also({}, true)
          .bytes("trailer", &M::trailer, "optional bytes after the frame, not counted as damage: CR LF")
          .object("text", text_keys(), &M::text, "a text frame with fields in columns")
          .object("items", item_keys(), &M::items, "tag-length-value items")
          .object("blocks", block_keys(), &M::blocks, "optional blocks of fixed sizes in the order of a mask's bits")
          .then(set_structure)
          .objects(Form::kOne, "layout", layout_keys(), add_layout, "parts in sequence")
          .custom(
              "fields", {{"type", "object"}, {"additionalProperties", field_keys().schema()}},
              "named numbers in the frame; one inside another is a view of its bits",
              [](const Section& s, M& kind) { read_fields(s.object("fields"), 0, kind); }, nullptr)
          .then([](const Section& s, M& kind) {
            if (!s.has("blocks")) return;
            const Section blocks = s.object("blocks");
            kind.blocks.mask_field = kind.field_index(blocks.text("mask"));
            if (kind.blocks.mask_field < 0) blocks.fail("mask", "this message type has no such field");
          })
          .objects(
              Form::kOneOrMore, "body", body_keys(),
              [](const Section&, const std::string&, BodyRule rule, M& kind) {
                rule.value &= rule.mask;
                kind.body.push_back(rule);
              },
              "every byte has (byte & mask) == value")
          .objects(Form::kOneOrMore, "refuse", bits_keys(true, true), add_refusal,
                   "not a data frame if (field & mask) == value, although its check is right")
          .objects(
              Form::kOneOrMore, "checks", check_keys(),
              [](const Section&, const std::string&, const CheckDraft& draft, M& kind) {
                kind.checks.push_back(draft.rule);
              },
              "")
          .then(measure);
  return keys;
}

}  // namespace prism::wire
