// SPDX-License-Identifier: MIT
// Reads fields and scalings from a description's JSON.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "drivers/wire/field.hpp"
#include "drivers/wire/json_section.hpp"

namespace prism::wire {

/// A field whose references to other fields, items and blocks are still names.
struct FieldDraft {
  Field field;
  std::string pointer;
  std::string when_field;
  std::optional<std::uint64_t> item;
  std::optional<std::uint64_t> block;
};

/// `json` is the field's object; `shift_at` is added to a place from the start (fields of a part); `text` says that
/// fields stand in columns.
FieldDraft read_field(Problems& problems, const Json& json, const std::string& pointer, const std::string& name,
                      bool big_endian, bool text, int shift_at = 0);

/// "u16", "s24", "f32" … of a length field: number type, bits, size and order only.
void read_number_type(const Section& section, bool big_endian, Field& field);

/// scale, offset, convert, min, max.
Scaling read_scaling(const Section& section);

}  // namespace prism::wire
