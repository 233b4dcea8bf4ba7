// SPDX-License-Identifier: MIT
// Reads the structure of a frame from JSON: sync, length, items, blocks, columns, checks.
#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "compensation/text_columns.hpp"
#include "drivers/wire/description/frame_view.hpp"
#include "drivers/wire/description/readers.hpp"

namespace prism::wire {
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
