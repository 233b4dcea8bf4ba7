// SPDX-License-Identifier: MIT
// The readers of a description's JSON, from the field to the whole; parse_frame_description runs them.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "base/json_section.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::wire {

/// No frame of any kind is longer.
inline constexpr int kMaxFrameBytes = 8192;

/// "big" (true) or "little".
inline bool read_byte_order(const Section& section, const char* key, bool preset_big) {
  return section.choice(key, {"big", "little"}, preset_big ? 0 : 1) == 0;
}

/// A field whose references to other fields, items and blocks are still names.
struct FieldDraft {
  Field field;
  Section section;
  std::string when_field;
  std::optional<std::uint64_t> item;
  std::optional<std::uint64_t> block;
};

/// `shift_at` is added to a place from the start (fields of a layout's part); `text` says that fields stand in columns.
FieldDraft read_field(const Section& section, const std::string& name, bool big_endian, bool text, int shift_at);
/// "type" ("u16", "s24", "f32" …) and "order" of a field whose grouping and shift are known; `bytes`: as said, 0: as
/// many as the type needs.
void read_number_type(const Section& section, bool big_endian, std::int64_t bytes, Field& field);
/// scale, offset, convert, min, max.
Scaling read_scaling(const Section& section);

void read_sync(const Section& section, FrameKind& kind);
/// The key "length" of a kind's section.
void read_length(const Section& kind_section, bool big_endian, FrameKind& kind);
void read_items(const Section& section, bool big_endian, FrameKind& kind);
void read_text(const Section& section, FrameKind& kind);
/// All but the mask field, which is not read yet.
void read_blocks(const Section& section, FrameKind& kind);
CheckRule read_check(const Section& section, bool big_endian);

/// A group of fields that several kinds have in common, placed by a kind's "layout".
struct FieldGroup {
  Section section;
  int size = 0;  ///< bytes
};
using FieldGroups = std::map<std::string, FieldGroup>;

/// The description's "parts".
FieldGroups read_field_groups(const Section& description);
/// Without roles, which read_roles gives. `big_endian` is the description's byte order.
FrameKind read_kind(const Section& section, bool big_endian, const FieldGroups& groups);

/// After the kinds: gives each kind its roles and the description its rules.
void read_roles(const Section& section, const GyroChoice& choice, FrameDescription& description);

/// Refuses the first thing that a description must not say although every key is legal (overlaps, places outside the
/// frame, impossible rates), and adds to its warnings what is legal but worth knowing. `section` is the whole one.
void check_description(const Section& section, FrameDescription& description);

}  // namespace prism::wire
