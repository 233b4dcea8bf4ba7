// SPDX-License-Identifier: MIT
// From the JSON of a frame's build to its rules.
#include "drivers/wire/structure_reader.hpp"

#include <fmt/format.h>

#include "drivers/wire/field_reader.hpp"
#include "drivers/wire/frame_view.hpp"

namespace prism::wire {

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
  kind.structure = Structure::kItems;
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
  kind.structure = Structure::kColumns;
  kind.text.separators = s.text("separators");
  kind.text.collapse = s.flag("collapse", false);
  kind.text.columns = static_cast<std::uint32_t>(s.whole("columns", 0, 64, 0));
  kind.text.write = s.text("write", "");
  if (kind.text.separators.empty()) s.refuse("separators", "is empty; expected at least one character");
}

void read_blocks(const Section& s, FrameKind& kind) {
  kind.structure = Structure::kBlocks;
  kind.blocks.from = static_cast<int>(s.whole("from", 0, kMaxFrameBytes));
  for (const std::uint64_t size : s.bit_list("sizes"))
    kind.blocks.sizes.push_back(static_cast<std::uint32_t>(size & 0xFFFF));
  if (kind.blocks.sizes.size() > FrameView::kMaxPlaces)
    s.refuse("sizes", "has more than 64 blocks"), kind.blocks.sizes.resize(1);
}

}  // namespace prism::wire
