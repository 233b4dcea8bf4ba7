// SPDX-License-Identifier: MIT
// From a kind's JSON to its tables.
#include "drivers/wire/kind_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "drivers/wire/check_reader.hpp"
#include "drivers/wire/field_reader.hpp"
#include "drivers/wire/frame_view.hpp"

namespace prism {
namespace {

constexpr std::int64_t kMaxFrameBytes = 8192;

/// Calls read(Section, index) for each object of an array (or for one object that stands alone).
template <class Read>
void for_each_section(const Section& s, const char* key, std::string_view section, Read read) {
  if (!s.has(key)) return;
  const Json& json = s.at(key);
  if (json.is_object()) return read(Section(s.problems(), json, s.pointer(key), section));
  if (!json.is_array()) return s.refuse(key, found(json) + " is neither an object nor an array of objects");
  for (std::size_t i = 0; i < json.size(); ++i) {
    read(Section(s.problems(), json[i], s.pointer(fmt::format("{}/{}", key, i)), section));
  }
}

void read_sync(const Section& s, FrameKind& kind) {
  const auto at = static_cast<std::uint32_t>(s.whole("at", 0, 255, 0));
  const std::vector<std::uint8_t> bytes = s.bytes("bytes");
  std::vector<std::uint8_t> mask = s.bytes("mask", false);
  if (mask.empty()) mask.assign(bytes.size(), 0xFF);
  if (mask.size() != bytes.size()) {
    return s.refuse("mask", fmt::format("has {} bytes; expected {} as in \"bytes\"", mask.size(), bytes.size()));
  }
  for (std::uint32_t i = 0; i < bytes.size(); ++i) {
    if (mask[i] == 0) continue;
    kind.sync.push_back({at + i, static_cast<std::uint8_t>(bytes[i] & mask[i]), mask[i]});
  }
}

void read_length(const Section& s, bool big_endian, FrameKind& kind) {
  LengthRule& length = kind.length;
  if (!s.at("length").is_object()) {
    length.min = length.max = static_cast<std::uint32_t>(s.whole("length", 1, kMaxFrameBytes));
    return;
  }
  const Section l = s.sub("length", "length");
  length.min = static_cast<std::uint32_t>(l.whole("min", 1, kMaxFrameBytes, 1));
  length.max = static_cast<std::uint32_t>(l.whole("max", 1, kMaxFrameBytes));
  if (length.min > length.max) l.refuse("max", fmt::format("{} is below min {}", length.max, length.min));
  if (l.has("terminator")) {
    length.form = LengthRule::Form::kTerminated;
    length.terminator = l.bytes("terminator");
    return;
  }
  length.form = LengthRule::Form::kField;
  length.field.at = static_cast<int>(l.whole("at", 0, 255));
  read_number_type(l, big_endian, length.field);
  length.multiply = static_cast<std::int32_t>(l.whole("multiply", 1, 64, 1));
  length.add = static_cast<std::int32_t>(l.whole("add", -1024, 1024, 0));
}

void read_items(const Section& s, bool big_endian, FrameKind& kind) {
  ItemRule& items = kind.items;
  items.present = true;
  items.from = static_cast<int>(s.whole("from", 0, kMaxFrameBytes));
  items.to = static_cast<int>(s.whole("to", -kMaxFrameBytes, 0, 0));
  items.id_size = static_cast<std::uint8_t>(s.whole("id_size", 1, 4, 1));
  items.length_size = static_cast<std::uint8_t>(s.whole("length_size", 1, 2, 1));
  items.length_first = s.flag("length_first", false);
  items.length_includes_header = s.flag("length_includes_header", false);
  items.big_endian = s.byte_order("order", big_endian);
  if (s.has("send")) items.sent = s.bit_list("send");
}

void read_text(const Section& s, FrameKind& kind) {
  kind.text.present = true;
  kind.text.separators = s.text("separators");
  kind.text.collapse = s.flag("collapse", false);
  kind.text.columns = static_cast<std::uint32_t>(s.whole("columns", 0, 64, 0));
  kind.text.write = s.text("write", "");
  if (kind.text.separators.empty()) s.refuse("separators", "is empty; expected at least one character");
}

void place_field(const FieldDraft& draft, Problems& problems, FrameKind& kind) {
  Field field = draft.field;
  if (field_index(kind, field.name) >= 0) problems.add(draft.pointer, "this kind has a field of that name already");
  if (draft.item && draft.block) problems.add(draft.pointer, "stands in an item and in a block; expected one of them");
  if (draft.item) {
    if (!kind.items.present) problems.add(draft.pointer + "/item", "this kind has no \"items\"");
    auto& ids = kind.items.ids;
    const auto at = std::find(ids.begin(), ids.end(), *draft.item);
    field.item = static_cast<int>(at - ids.begin());
    if (at == ids.end()) ids.push_back(*draft.item);
    if (ids.size() > FrameView::kMaxPlaces) problems.add(draft.pointer, "is in a 65th item; expected at most 64"), ids.pop_back();
  }
  if (draft.block) {
    field.item = static_cast<int>(std::min<std::uint64_t>(*draft.block, FrameView::kMaxPlaces - 1));
    const std::size_t blocks = kind.blocks.sizes.size();
    if (*draft.block >= blocks) problems.add(draft.pointer + "/block", fmt::format("{} is no block; this kind has {}", *draft.block, blocks));
  }
  if (!draft.when_field.empty()) {
    field.when.field = field_index(kind, draft.when_field);
    if (field.when.field < 0) {
      problems.add(draft.pointer + "/when/field", fmt::format("no field \"{}\" stands before this one", draft.when_field));
    }
  }
  kind.fields.push_back(std::move(field));
}

void read_fields(Problems& problems, const Json& json, const std::string& pointer, bool big_endian, int at, FrameKind& kind) {
  if (!json.is_object()) return problems.add(pointer, found(json) + " is not an object of fields");
  for (const auto& [name, field] : json.items()) {
    place_field(read_field(problems, field, pointer + "/" + name, name, big_endian, kind.text.present, at), problems, kind);
  }
}

void read_layout(const Section& s, bool big_endian, const Parts& parts, FrameKind& kind) {
  auto at = static_cast<int>(s.whole("at", 0, 255, 0));
  for (const std::string& name : s.texts("parts")) {
    const auto part = parts.find(name);
    if (part == parts.end()) {
      s.refuse("parts", fmt::format("\"{}\" is none of the description's parts", name));
      continue;
    }
    read_fields(s.problems(), *part->second.fields, part->second.pointer, big_endian, at, kind);
    at += part->second.size;
  }
}

void read_blocks(const Section& s, FrameKind& kind) {
  kind.blocks.from = static_cast<int>(s.whole("from", 0, kMaxFrameBytes));
  for (const std::uint64_t size : s.bit_list("sizes")) kind.blocks.sizes.push_back(static_cast<std::uint32_t>(size & 0xFFFF));
  if (kind.blocks.sizes.size() > FrameView::kMaxPlaces) s.refuse("sizes", "has more than 64 blocks"), kind.blocks.sizes.resize(1);
}

void read_rules(const Section& s, FrameKind& kind) {
  for_each_section(s, "body", "body", [&](const Section& b) {
    BodyRule rule;
    rule.from = static_cast<int>(b.whole("from", -kMaxFrameBytes, kMaxFrameBytes, 0));
    rule.to = static_cast<int>(b.whole("to", -kMaxFrameBytes, kMaxFrameBytes, 0));
    rule.mask = static_cast<std::uint8_t>(b.bits("mask") & 0xFF);
    rule.value = static_cast<std::uint8_t>(b.bits("value", 0) & rule.mask);
    kind.body.push_back(rule);
  });
  for_each_section(s, "refuse", "refuse", [&](const Section& r) {
    const RefuseRule rule{field_index(kind, r.text("field")), r.bits("mask"), r.bits("value")};
    if (rule.field < 0) return r.refuse("field", "this kind has no such field");
    kind.refuse.push_back(rule);
  });
}

/// The bytes that must be there before length and header checks can be trusted.
void measure(FrameKind& kind) {
  std::sort(kind.sync.begin(), kind.sync.end(), [](const ByteRule& a, const ByteRule& b) { return a.at < b.at; });
  std::uint32_t header = 1;
  for (const ByteRule& rule : kind.sync) header = std::max(header, rule.at + 1);
  if (kind.length.form == LengthRule::Form::kField) {
    header = std::max(header, static_cast<std::uint32_t>(kind.length.field.at) + kind.length.field.size);
  }
  for (CheckRule& check : kind.checks) {
    const bool early = check.from >= 0 && check.to > 0 && check.at >= 0 && check.mark == 0 && check.to <= 8 && check.at < 8;
    check.in_header = early && kind.length.form == LengthRule::Form::kField;
    if (check.in_header) header = std::max({header, static_cast<std::uint32_t>(check.to), static_cast<std::uint32_t>(check.at) + check.size});
  }
  kind.header_bytes = header;
}

/// How many bits say that this is a frame, and how many good ones in a row it takes to believe a weak kind: until 32 bits
/// have spoken.
void weigh(FrameKind& kind) {
  for (const CheckRule& check : kind.checks) kind.check_bits += check.bits;
  kind.known_bits = kind.check_bits + 8 * static_cast<int>(kind.length.terminator.size());
  for (const ByteRule& rule : kind.sync) kind.known_bits += std::popcount(rule.mask);
  const int body_bits = kind.text.present ? 8 * static_cast<int>(kind.length.min) : static_cast<int>(kind.body.size());
  kind.known_bits += std::min(body_bits, 16);
  kind.weak = kind.known_bits < 16;
  const int frames = (31 + kind.known_bits) / std::max(kind.known_bits, 1);
  kind.confirmations = kind.check_bits >= 16 ? 1 : std::clamp(frames, 2, 16);
}

}  // namespace

int field_index(const FrameKind& kind, std::string_view name) {
  for (std::size_t i = 0; i < kind.fields.size(); ++i) {
    if (kind.fields[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

Parts read_parts(const Section& description) {
  Parts parts;
  if (!description.has("parts")) return parts;
  const Json& json = description.at("parts");
  if (!json.is_object()) {
    description.refuse("parts", found(json) + " is not an object of parts");
    return parts;
  }
  for (const auto& [name, part] : json.items()) {
    const Section s(description.problems(), part, description.pointer("parts/" + name), "part");
    parts[name] = {&s.at("fields"), s.pointer("fields"), static_cast<int>(s.whole("size", 1, kMaxFrameBytes))};
  }
  return parts;
}

FrameKind read_kind(Problems& problems, const Json& json, const std::string& pointer, bool big_endian, const Parts& parts) {
  const Section s(problems, json, pointer, "kind");
  FrameKind kind;
  kind.name = s.text("name");
  for_each_section(s, "sync", "sync", [&](const Section& one) { read_sync(one, kind); });
  if (s.has("after")) {
    const std::vector<std::uint8_t> after = s.bytes("after");
    kind.after = after.empty() ? -1 : after[0];
    if (after.size() > 1) s.refuse("after", "has more than one byte");
  }
  read_length(s, big_endian, kind);
  kind.trailer = s.bytes("trailer", false);
  if (s.has("text")) read_text(s.sub("text", "text"), kind);
  if (s.has("items")) read_items(s.sub("items", "items"), big_endian, kind);
  if (s.has("blocks")) read_blocks(s.sub("blocks", "blocks"), kind);
  if (kind.text.present && kind.length.form != LengthRule::Form::kTerminated) s.refuse("text", "needs a length with a terminator");
  if (s.has("layout")) read_layout(s.sub("layout", "layout"), big_endian, parts, kind);
  if (s.has("fields")) read_fields(problems, s.at("fields"), s.pointer("fields"), big_endian, 0, kind);
  if (s.has("blocks")) {
    const Section b = s.sub("blocks", "blocks");
    kind.blocks.mask_field = field_index(kind, b.text("mask"));
    if (kind.blocks.mask_field < 0) b.refuse("mask", "this kind has no such field");
  }
  read_rules(s, kind);
  for_each_section(s, "checks", "check", [&](const Section& one) { kind.checks.push_back(read_check(one, big_endian)); });
  measure(kind);
  weigh(kind);
  return kind;
}

}  // namespace prism
