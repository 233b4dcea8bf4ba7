// SPDX-License-Identifier: MIT
// Builds the constant part of a frame.
#include "drivers/wire/encode/blank_frame.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/wire/description/frame_view.hpp"

namespace prism::wire {
namespace {

void append_number(std::vector<std::uint8_t>& out, std::uint64_t value, std::size_t size, bool big_endian) {
  for (std::size_t i = 0; i < size; ++i)
    out.push_back(static_cast<std::uint8_t>(value >> 8 * (big_endian ? size - 1 - i : i)));
}

/// Number of bytes covered by the fields of an item.
std::uint32_t payload_of(const MessageType& kind, std::size_t item) {
  std::uint32_t size = 0;
  for (const Field& field : kind.fields) {
    if (field.item == static_cast<int>(item) && field.at >= 0)
      size = std::max(size, static_cast<std::uint32_t>(field.at) + field.size);
  }
  return size;
}

std::vector<std::uint8_t> items_of(const MessageType& kind) {
  const ItemRule& rule = kind.items;
  std::vector<std::uint8_t> out;
  for (const std::uint64_t id : rule.sent.empty() ? rule.ids : rule.sent) {
    const auto index = static_cast<std::size_t>(std::find(rule.ids.begin(), rule.ids.end(), id) - rule.ids.begin());
    const std::uint32_t payload = payload_of(kind, index);
    const std::uint32_t length =
        payload + (rule.length_includes_header ? std::uint32_t{rule.id_size} + rule.length_size : 0);
    if (rule.length_first) append_number(out, length, rule.length_size, rule.big_endian);
    append_number(out, id, rule.id_size, rule.big_endian);
    if (!rule.length_first) append_number(out, length, rule.length_size, rule.big_endian);
    out.resize(out.size() + payload);
  }
  return out;
}

std::size_t blocks_length(const MessageType& kind) {
  const auto mask = static_cast<std::uint64_t>(kind.fields[static_cast<std::size_t>(kind.blocks.mask_field)].preset);
  std::size_t length = 0;
  for (std::size_t i = 0; i < kind.blocks.sizes.size(); ++i) length += (mask >> i & 1) != 0 ? kind.blocks.sizes[i] : 0;
  return length;
}

/// Bytes after the part of variable length: for checks and fields positioned from the end.
std::size_t tail_of(const MessageType& kind) {
  int tail = 0;
  for (const CheckRule& check : kind.checks) tail = std::max(tail, -check.at);
  for (const Field& field : kind.fields) tail = std::max(tail, field.item < 0 ? -field.at : 0);
  return static_cast<std::size_t>(tail);
}

void write_presets(const MessageType& kind, std::vector<std::uint8_t>& frame) {
  FrameView view;
  for (const Field& field : kind.fields) {
    if (field.preset == 0 || !view.look_at(kind, frame)) continue;
    if (const std::uint8_t* at = view.find(field))
      store_number(field, frame.data() + (at - frame.data()), field.preset);
  }
}

/// The terminator, and digits where fields have hexadecimal ones.
void write_characters(const MessageType& kind, std::vector<std::uint8_t>& frame) {
  const std::vector<std::uint8_t>& end = kind.length.terminator;
  if (end.size() <= frame.size())
    std::copy(end.begin(), end.end(), frame.end() - static_cast<std::ptrdiff_t>(end.size()));
  const auto length = static_cast<std::ptrdiff_t>(frame.size());
  for (const Field& field : kind.fields) {
    const std::ptrdiff_t at = field.at < 0 ? length + field.at : field.at;
    if (field.is_hex() && at >= 0 && at + field.size <= length)
      std::fill_n(frame.begin() + at, field.size, std::uint8_t{'0'});
  }
}

}  // namespace

void apply_constants(const MessageType& kind, std::span<std::uint8_t> frame) {
  const auto length = static_cast<int>(frame.size());
  for (const BodyRule& rule : kind.body) {
    const int to = rule.to <= 0 ? length + rule.to : rule.to;
    for (int i = rule.from < 0 ? length + rule.from : rule.from; i < std::min(to, length); ++i) {
      auto& byte = frame[static_cast<std::size_t>(i)];
      byte = static_cast<std::uint8_t>((byte & ~rule.mask) | rule.value);
    }
  }
  for (const ByteRule& rule : kind.sync) {
    if (rule.at < frame.size()) frame[rule.at] = static_cast<std::uint8_t>((frame[rule.at] & ~rule.mask) | rule.value);
  }
}

std::vector<std::uint8_t> blank_frame(const MessageType& kind) {
  std::vector<std::uint8_t> frame(kind.length.min);
  if (kind.structure == Structure::kItems) {
    frame.assign(static_cast<std::size_t>(kind.items.from), 0);
    const std::vector<std::uint8_t> items = items_of(kind);
    frame.insert(frame.end(), items.begin(), items.end());
    frame.resize(std::max<std::size_t>(frame.size() + static_cast<std::size_t>(-kind.items.to), kind.length.min));
  } else if (kind.structure == Structure::kBlocks) {
    frame.assign(static_cast<std::size_t>(kind.blocks.from) + blocks_length(kind) + tail_of(kind), 0);
    const Field& mask = kind.fields[static_cast<std::size_t>(kind.blocks.mask_field)];
    store_number(mask, frame.data() + mask.at, mask.preset);
  }
  if (kind.length.form == LengthRule::LengthType::kField) {
    const Field& field = kind.length.field;
    const std::int64_t value = static_cast<std::int64_t>(frame.size()) - kind.length.add;
    store_bits(field, frame.data() + field.at, static_cast<std::uint64_t>(value));
  }
  write_characters(kind, frame);
  apply_constants(kind, frame);
  write_presets(kind, frame);
  return frame;
}

}  // namespace prism::wire
