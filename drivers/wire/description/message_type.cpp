// SPDX-License-Identifier: MIT
// Compiles a message type from its JSON, and computes how reliably its frames are recognised.
#include "drivers/wire/description/message_type.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "compensation/text_columns.hpp"
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

// Reads the structure of a frame from JSON: sync, length, items, blocks, columns, checks.

namespace {

constexpr Range kOffset{-kMaxFrameBytes, kMaxFrameBytes};  // of a byte, from the start or the end

void read_crc(const Section& s, CheckRule& rule) {
  CrcParameters parameters;
  parameters.width = static_cast<int>(s.integer("width", {3, 64}));
  parameters.poly = s.bits("poly");
  parameters.init = s.bits("init", parameters.init);
  parameters.reflect_in = s.boolean("reflect_in", parameters.reflect_in);
  parameters.reflect_out = s.boolean("reflect_out", parameters.reflect_in);
  parameters.xor_out = s.bits("xor_out", parameters.xor_out);
  rule.crc = std::make_shared<const Crc>(parameters);
  rule.pad_to = static_cast<std::uint32_t>(s.integer("pad_to", {1, 64}, 1));
  rule.bits = parameters.width;
  rule.size = static_cast<std::uint8_t>((parameters.width + 7) / 8);
}

void read_stored(const Section& s, CheckRule& rule) {
  rule.stored = static_cast<CheckRule::Stored>(s.choice("text", {"no", "hex", "decimal"}, 0));
  const std::string separator = s.raw_text("mark", "");
  if (rule.stored == CheckRule::Stored::kBinary) return;
  if (s.has("mark") && separator.size() != 1)
    return s.fail("mark", "not one character; expected the character before the check");
  rule.separator = separator.empty() ? '\0' : separator[0];
  if (rule.stored == CheckRule::Stored::kHexText) rule.size = static_cast<std::uint8_t>(2 * rule.size);
}

}  // namespace

void read_sync(const Section& s, MessageType& kind) {
  const auto at = static_cast<std::uint32_t>(s.integer("at", {0, 255}, 0));
  const std::vector<std::uint8_t> bytes = s.bytes("bytes");
  std::vector<std::uint8_t> mask = s.bytes("mask", false);
  if (mask.empty()) mask.assign(bytes.size(), 0xFF);
  if (mask.size() != bytes.size()) {
    return s.fail("mask", fmt::format("found {} bytes; expected {} as in \"bytes\"", mask.size(), bytes.size()));
  }
  for (std::uint32_t i = 0; i < bytes.size(); ++i) {
    if (mask[i] == 0) continue;
    kind.sync.push_back({at + i, static_cast<std::uint8_t>(bytes[i] & mask[i]), mask[i]});
  }
}

void read_length(const Section& s, bool big_endian, MessageType& kind) {
  constexpr Range kLength{1, kMaxFrameBytes};
  LengthRule& length = kind.length;
  if (!s.is_object("length")) {
    length.min = length.max = static_cast<std::uint32_t>(s.integer("length", kLength));
    return;
  }
  const Section l = s.object("length");
  l.allow({"at", "type", "order", "add"});
  length.min = static_cast<std::uint32_t>(l.integer("min", kLength, 1));
  length.max = static_cast<std::uint32_t>(l.integer("max", kLength));
  if (length.min > length.max) l.fail("max", fmt::format("{} is below min {}", length.max, length.min));
  if (l.has("terminator")) {
    length.form = LengthRule::LengthType::kTerminated;
    length.terminator = l.bytes("terminator");
    return;
  }
  length.form = LengthRule::LengthType::kField;
  length.field.at = static_cast<int>(l.integer("at", {0, 255}));
  read_number_type(l, big_endian, 0, length.field);
  length.add = static_cast<std::int32_t>(l.integer("add", {-1024, 1024}, length.add));
}

void read_items(const Section& s, bool big_endian, MessageType& kind) {
  ItemRule& items = kind.items;
  kind.structure = Structure::kItems;
  items.from = static_cast<int>(s.integer("from", {0, kMaxFrameBytes}));
  items.to = static_cast<int>(s.integer("to", {-kMaxFrameBytes, 0}, items.to));
  items.id_size = static_cast<std::uint8_t>(s.integer("id_size", {1, 4}, items.id_size));
  items.length_size = static_cast<std::uint8_t>(s.integer("length_size", {1, 2}, items.length_size));
  items.length_first = s.boolean("length_first", items.length_first);
  items.length_includes_header = s.boolean("length_includes_header", items.length_includes_header);
  items.big_endian = read_byte_order(s, "order", big_endian);
  if (s.has("send")) items.sent = s.bit_list("send");
}

void read_text(const Section& s, MessageType& kind) {
  kind.structure = Structure::kColumns;
  kind.text.separators = s.raw_text("separators");
  kind.text.collapse = s.boolean("collapse", kind.text.collapse);
  kind.text.columns = static_cast<std::uint32_t>(s.integer("columns", {0, FrameView::kMaxElements}, 0));
  if (s.boolean("decimal_comma", false)) kind.text.point = ',';
  kind.text.write = s.raw_text("write", "");
  if (const std::string problem = separators_problem(kind.text.separators); !problem.empty())
    s.fail("separators", problem);
  if (kind.text.separators.find(kind.text.point) != std::string::npos)
    s.fail("separators", fmt::format("contains '{}', which can occur in numbers", kind.text.point));
}

void read_blocks(const Section& s, MessageType& kind) {
  kind.structure = Structure::kBlocks;
  kind.blocks.from = static_cast<int>(s.integer("from", {0, kMaxFrameBytes}));
  for (const std::uint64_t size : s.bit_list("sizes"))
    kind.blocks.sizes.push_back(static_cast<std::uint32_t>(size & 0xFFFF));
  if (kind.blocks.sizes.size() > FrameView::kMaxElements)
    s.fail("sizes", fmt::format("has more than {} blocks", FrameView::kMaxElements));
}

CheckRule read_check(const Section& s, bool big_endian) {
  CheckRule rule;
  s.allow({"width", "poly", "init", "reflect_in", "reflect_out", "xor_out", "pad_to", "odd", "at"});
  rule.sum = static_cast<CheckRule::Sum>(s.choice("kind", {"crc", "sum", "xor", "fletcher", "parity"}));
  const bool crc = rule.sum == CheckRule::Sum::kCrc;
  rule.from = static_cast<int>(s.integer("from", kOffset, rule.from));
  rule.to = static_cast<int>(s.integer("to", kOffset, rule.to));
  rule.big_endian = read_byte_order(s, "order", big_endian);
  rule.word = static_cast<std::uint8_t>(s.integer("word", {1, 4}, rule.word));
  if (rule.word == 3) s.fail("word", "found 3, expected 1, 2 or 4");
  rule.negate = s.boolean("negate", rule.negate);
  rule.size = rule.sum == CheckRule::Sum::kFletcher ? std::uint8_t{2} : rule.word;
  if (crc)
    read_crc(s, rule);
  else
    rule.init = s.bits("init", rule.init);
  rule.size = static_cast<std::uint8_t>(s.integer("size", {1, 8}, rule.size));
  rule.mask = s.bits("mask", rule.mask);
  if (!crc) rule.bits = std::min(8 * rule.size, std::popcount(rule.mask));
  if (rule.sum == CheckRule::Sum::kParity) {
    rule.bits = 1;
    rule.odd = s.boolean("odd", rule.odd);
    if (std::popcount(rule.mask) != 1 || rule.mask > 0xFF) s.fail("mask", "is not one bit of the byte at \"at\"");
  }
  read_stored(s, rule);
  if (rule.separator == 0) rule.at = static_cast<int>(s.integer("at", kOffset));
  return rule;
}

}  // namespace prism::wire
