// SPDX-License-Identifier: MIT
// Prints a daemon's responses without control characters that act on a terminal.
#pragma once

#include <fmt/format.h>

#include <string_view>

#include "base/escape.hpp"

namespace prism::prismctl {

/// Prints a value (any nlohmann type) as JSON; characters that are not printable are written as u-escapes (four
/// hexadecimal digits).
template <class AnyJson>
void print_json(const AnyJson& value, int indent = -1) {
  fmt::print("{}\n", printable_json(json_text(value, indent)));
}

/// Prints one or more lines.
inline void print_text(std::string_view text) { fmt::print("{}", printable_lines(text)); }

/// Prints one line of a log as it is; on a terminal as printable().
void print_log_line(std::string_view line);

}  // namespace prism::prismctl
