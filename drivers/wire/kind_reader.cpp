// SPDX-License-Identifier: MIT
// From a kind's JSON to its tables.
#include "drivers/wire/kind_reader.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "drivers/wire/check_reader.hpp"
#include "drivers/wire/field_reader.hpp"
#include "drivers/wire/frame_view.hpp"
#include "drivers/wire/kind_strength.hpp"
#include "drivers/wire/structure_reader.hpp"

namespace prism::wire {
namespace {

void place_field(const FieldDraft& draft, Problems& problems, FrameKind& kind) {
  Field field = draft.field;
  if (field_index(kind, field.name) >= 0) problems.add(draft.pointer, "this kind has a field of that name already");
  if (draft.item && draft.block) problems.add(draft.pointer, "stands in an item and in a block; expected one of them");
  if (draft.item) {
    if (kind.structure != Structure::kItems) problems.add(draft.pointer + "/item", "this kind has no \"items\"");
    auto& ids = kind.items.ids;
    const auto at = std::find(ids.begin(), ids.end(), *draft.item);
    field.item = static_cast<int>(at - ids.begin());
    if (at == ids.end()) ids.push_back(*draft.item);
    if (ids.size() > FrameView::kMaxPlaces)
      problems.add(draft.pointer, "is in a 65th item; expected at most 64"), ids.pop_back();
  }
  if (draft.block) {
    field.item = static_cast<int>(std::min<std::uint64_t>(*draft.block, FrameView::kMaxPlaces - 1));
    const std::size_t blocks = kind.blocks.sizes.size();
    if (*draft.block >= blocks)
      problems.add(draft.pointer + "/block", fmt::format("{} is no block; this kind has {}", *draft.block, blocks));
  }
  if (!draft.when_field.empty()) {
    field.when.field = field_index(kind, draft.when_field);
    if (field.when.field < 0) {
      problems.add(draft.pointer + "/when/field",
                   fmt::format("no field \"{}\" stands before this one", draft.when_field));
    }
  }
  kind.fields.push_back(std::move(field));
}

void read_fields(Problems& problems, const Json& json, const std::string& pointer, bool big_endian, int at,
                 FrameKind& kind) {
  if (!json.is_object()) return problems.add(pointer, found(json) + " is not an object of fields");
  for (const auto& [name, field] : json.items()) {
    place_field(
        read_field(problems, field, pointer + "/" + name, name, big_endian, kind.structure == Structure::kColumns, at),
        problems, kind);
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

FrameKind read_kind(Problems& problems, const Json& json, const std::string& pointer, bool big_endian,
                    const Parts& parts) {
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
  if (s.has("text") + s.has("items") + s.has("blocks") > 1)
    s.refuse("", "has more than one of \"text\", \"items\", \"blocks\"; expected at most one");
  if (s.has("text")) read_text(s.sub("text", "text"), kind);
  if (s.has("items")) read_items(s.sub("items", "items"), big_endian, kind);
  if (s.has("blocks")) read_blocks(s.sub("blocks", "blocks"), kind);
  if (kind.structure == Structure::kColumns && kind.length.form != LengthRule::Form::kTerminated)
    s.refuse("text", "needs a length with a terminator");
  if (s.has("layout")) read_layout(s.sub("layout", "layout"), big_endian, parts, kind);
  if (s.has("fields")) read_fields(problems, s.at("fields"), s.pointer("fields"), big_endian, 0, kind);
  if (s.has("blocks")) {
    const Section b = s.sub("blocks", "blocks");
    kind.blocks.mask_field = field_index(kind, b.text("mask"));
    if (kind.blocks.mask_field < 0) b.refuse("mask", "this kind has no such field");
  }
  read_rules(s, kind);
  for_each_section(s, "checks", "check",
                   [&](const Section& one) { kind.checks.push_back(read_check(one, big_endian)); });
  measure_header(kind);
  weigh(kind);
  return kind;
}

}  // namespace prism::wire
