// SPDX-License-Identifier: MIT
// Readers of a description's JSON, from fields to the complete description; called by parse_frame_description.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "base/json_section.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::wire {

/// Maximum length of a frame of any message type.
inline constexpr int kMaxFrameBytes = 8192;

/// "big" (true) or "little".
inline bool read_byte_order(const Section& section, const char* key, bool preset_big) {
  return section.choice(key, {"big", "little"}, preset_big ? 0 : 1) == 0;
}

/// A field whose references to other fields, items and blocks are not resolved yet.
struct FieldDraft {
  Field field;
  Section section;
  std::string when_field;
  std::optional<std::uint64_t> item;
  std::optional<std::uint64_t> block;
};

/// Adds `shift_at` to a position from the start (fields of a layout's part); `text`: fields are in columns.
FieldDraft read_field(const Section& section, const std::string& name, bool big_endian, bool text, int shift_at);
/// Reads "type" ("u16", "s24", "f32" …) and "order" of a field whose grouping and shift are known; `bytes`: 0: as many
/// as the type needs.
void read_number_type(const Section& section, bool big_endian, std::int64_t bytes, Field& field);
/// scale, offset, convert, min, max.
Conversion read_scaling(const Section& section);

void read_sync(const Section& section, MessageType& kind);
/// The key "length" of a message type's section.
void read_length(const Section& kind_section, bool big_endian, MessageType& kind);
void read_items(const Section& section, bool big_endian, MessageType& kind);
void read_text(const Section& section, MessageType& kind);
/// All rules except the mask field, which is not read yet.
void read_blocks(const Section& section, MessageType& kind);
CheckRule read_check(const Section& section, bool big_endian);

/// A group of fields shared by several message types, placed by the "layout" of a type.
struct FieldGroup {
  Section section;
  int size = 0;  ///< bytes
};
using FieldGroups = std::map<std::string, FieldGroup>;

/// The description's "parts".
FieldGroups read_field_groups(const Section& description);
/// Without roles, which read_roles adds. `big_endian` is the description's byte order.
MessageType read_kind(const Section& section, bool big_endian, const FieldGroups& groups);

/// Call after the message types are read: adds the roles of each type and the description's rules.
void read_roles(const Section& section, const GyroChoice& choice, FrameDescription& description);

/// Reports the first error among valid keys (overlaps, positions outside the frame, impossible rates), and adds
/// warnings for notable settings. `section` is the root; with `network` no speed of the line limits the rate.
void check_description(const Section& section, FrameDescription& description, bool network);

}  // namespace prism::wire
