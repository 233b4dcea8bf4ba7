// SPDX-License-Identifier: MIT
// Compiles a message type from its JSON, and computes how reliably its frames are recognised.
#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "drivers/wire/description/frame_view.hpp"
#include "drivers/wire/description/readers.hpp"

namespace prism::wire {
namespace {

constexpr int kSureBits = 32;  // known bits, in one frame or several in a row, required to accept a frame
constexpr int kWeakBits = 16;
constexpr int kMostConfirmations = 16;
constexpr std::uint32_t kEarlyBytes = 8;  // a check that ends within them can belong to the header

void place_field(const FieldDraft& draft, MessageType& kind) {
  const Section& s = draft.section;
  Field field = draft.field;
  if (kind.field_index(field.name) >= 0) s.fail("", "this message type already has a field of that name");
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
  if (!draft.when_field.empty()) {
    field.when.field = kind.field_index(draft.when_field);
    if (field.when.field < 0) s.fail("when/field", fmt::format("no field \"{}\" before this one", draft.when_field));
  }
  kind.fields.push_back(std::move(field));
}

void read_fields(const Section& fields, bool big_endian, int at, MessageType& kind) {
  const bool text = kind.structure == Structure::kColumns;
  for (const std::string& name : fields.names(TextRule::kMessageName)) {
    place_field(read_field(fields.object(name), name, big_endian, text, at), kind);
  }
}

void read_layout(const Section& s, bool big_endian, const FieldGroups& groups, MessageType& kind) {
  auto at = static_cast<int>(s.integer("at", {0, 255}, 0));
  for (const std::string& name : s.texts("parts")) {
    const auto group = groups.find(name);
    if (group == groups.end()) {
      s.fail("parts", fmt::format("\"{}\" is not in the description's parts", name));
      continue;
    }
    read_fields(group->second.section.object("fields", true), big_endian, at, kind);
    at += group->second.size;
  }
}

void read_rules(const Section& s, MessageType& kind) {
  constexpr Range kOffset{-kMaxFrameBytes, kMaxFrameBytes};
  for (const Section& b : s.one_or_more_objects("body")) {
    const auto mask = static_cast<std::uint8_t>(b.bits("mask") & 0xFF);
    kind.body.push_back({static_cast<int>(b.integer("from", kOffset, 0)), static_cast<int>(b.integer("to", kOffset, 0)),
                         mask, static_cast<std::uint8_t>(b.bits("value", 0) & mask)});
  }
  for (const Section& r : s.one_or_more_objects("refuse")) {
    const RejectRule rule{kind.field_index(r.text("field")), r.bits("mask"), r.bits("value")};
    if (rule.field < 0) return r.fail("field", "this message type has no such field");
    kind.rejects.push_back(rule);
  }
}

void read_structure(const Section& s, bool big_endian, const FieldGroups& groups, MessageType& kind) {
  const Section blocks = s.object("blocks");
  if (s.has("text") + s.has("items") + s.has("blocks") > 1)
    s.fail("", "has more than one of \"text\", \"items\", \"blocks\"; expected at most one");
  if (s.has("text")) read_text(s.object("text"), kind);
  if (s.has("items")) read_items(s.object("items"), big_endian, kind);
  if (s.has("blocks")) read_blocks(blocks, kind);
  if (kind.structure == Structure::kColumns && kind.length.form != LengthRule::LengthType::kTerminated)
    s.fail("text", "needs a length with a terminator");
  if (s.has("layout")) read_layout(s.object("layout"), big_endian, groups, kind);
  read_fields(s.object("fields"), big_endian, 0, kind);
  if (s.has("blocks")) {
    kind.blocks.mask_field = kind.field_index(blocks.text("mask"));
    if (kind.blocks.mask_field < 0) blocks.fail("mask", "this message type has no such field");
  }
}

/// The columns end before the terminator, or before a check without a mark.
void measure_tail(MessageType& kind) {
  auto tail = static_cast<int>(kind.length.terminator.size());
  for (const CheckRule& check : kind.checks) {
    if (check.separator == 0) tail = std::max(tail, -check.at);
  }
  kind.text.tail = static_cast<std::uint32_t>(tail);
}

/// Sorts the sync, finds the header's checks and the bytes they need.
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

/// Text must be parsable; body rules fix bits of each byte they cover. Neither is a check: at most 16 bits are counted.
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

/// Computes the number of bits that identify a frame, and how many good frames in a row confirm a weak message type.
void measure_strength(MessageType& kind) {
  for (const CheckRule& check : kind.checks) kind.check_bits += check.bits;
  kind.known_bits = kind.check_bits + 8 * static_cast<int>(kind.length.terminator.size());
  for (const ByteRule& rule : kind.sync) kind.known_bits += std::popcount(rule.mask);
  kind.known_bits += body_bits(kind);
  kind.weak = kind.known_bits < kWeakBits;
  const int frames = (kSureBits - 1 + kind.known_bits) / std::max(kind.known_bits, 1);
  if (kind.check_bits < kWeakBits) kind.confirmations = std::clamp(frames, 2, kMostConfirmations);
}

}  // namespace

FieldGroups read_field_groups(const Section& description) {
  FieldGroups groups;
  const Section parts = description.object("parts");
  for (const std::string& name : parts.names(TextRule::kMessageName)) {
    const Section part = parts.object(name);
    part.allow({"fields"});  // read at the positions set by a message type's layout
    groups.emplace(name, FieldGroup{part, static_cast<int>(part.integer("size", {1, kMaxFrameBytes}))});
  }
  return groups;
}

MessageType read_kind(const Section& s, bool big_endian, const FieldGroups& groups) {
  MessageType kind;
  kind.name = s.text("name", {}, TextRule::kMessageName);
  for (const Section& sync : s.one_or_more_objects("sync")) read_sync(sync, kind);
  const std::vector<std::uint8_t> after = s.bytes("after", false);
  if (!after.empty()) kind.after = after[0];
  if (after.size() > 1) s.fail("after", "has more than one byte");
  read_length(s, big_endian, kind);
  kind.trailer = s.bytes("trailer", false);
  read_structure(s, big_endian, groups, kind);
  read_rules(s, kind);
  for (const Section& check : s.one_or_more_objects("checks")) kind.checks.push_back(read_check(check, big_endian));
  measure_tail(kind);
  measure_header(kind);
  measure_strength(kind);
  return kind;
}

}  // namespace prism::wire
