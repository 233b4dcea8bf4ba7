// SPDX-License-Identifier: MIT
// The keys of a frame description's objects, and what a row reads before it is compiled.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/json_table.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::wire {

/// Maximum length of a frame of any message type.
inline constexpr int kMaxFrameBytes = 8192;

struct ConditionDraft {
  std::string field;
  std::uint64_t modulus = 0, mask = ~std::uint64_t{0};
  std::vector<std::uint64_t> values;
};

/// A field whose references to other fields, items and blocks are not resolved yet.
struct FieldDraft {
  Field field;
  std::optional<int> at, column;
  std::optional<std::uint64_t> item, block;
  std::optional<ConditionDraft> when;
};

const JsonTable<FieldDraft>& field_keys();
/// scale, offset, convert, min, max.
const JsonTable<Conversion>& scaling_keys();

/// (field & mask) == value.
struct BitsDraft {
  std::string field;
  std::uint64_t mask = ~std::uint64_t{0}, value = 0;
};

/// field, mask, and value, if it is required.
JsonTable<BitsDraft> bits_keys(bool value_is_required, bool mask_is_required);

/// A group of fields shared by several message types, placed by the "layout" of a type: its size, bytes.
JsonTable<int> part_keys();
/// All keys of a message type. Its roles are those of the description.
const JsonTable<MessageType>& message_keys();

/// A description and the choice that it is read for.
struct FrameDraft {
  FrameDescription description;
  GyroChoice choice;
  double arcsec_per_pulse = 0;
  std::vector<std::string> send;
};

/// The keys of the meaning of fields, gyro to latency: they add the roles of each message type and the description's
/// rules.
JsonTable<FrameDraft> role_keys();

/// JSON Schema of a description, with the defaults.
Json frame_schema();

/// Reports the first error among valid keys (overlaps, positions outside the frame, impossible rates), and adds
/// warnings for notable settings. `section` is the root; with `network` no speed of the line limits the rate.
void check_description(const Section& section, FrameDescription& description, bool network);

}  // namespace prism::wire
