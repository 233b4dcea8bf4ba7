// SPDX-License-Identifier: MIT
// Reads one kind of frame from a description's JSON: sync, length, rules, checks, fields.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "drivers/wire/frame_kind.hpp"
#include "drivers/wire/json_section.hpp"

namespace prism::wire {

/// A group of fields that several kinds have in common, placed by a kind's "layout".
struct Part {
  const Json* fields = nullptr;
  std::string pointer;
  int size = 0;
};

using Parts = std::map<std::string, Part>;

Parts read_parts(const Section& description);

/// Without roles: frame_description.cpp gives them. `big_endian` is the description's byte order.
FrameKind read_kind(Problems& problems, const Json& json, const std::string& pointer, bool big_endian,
                    const Parts& parts);

/// Index of a field by its name; -1 where the kind has none of that name.
int field_index(const FrameKind& kind, std::string_view name);

}  // namespace prism::wire
