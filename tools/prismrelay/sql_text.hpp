// SPDX-License-Identifier: MIT
// Converts text and JSON to what PostgreSQL accepts, and to CSV fields.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace prism::prismrelay {

/// Replaces invalid UTF-8 and NUL, which PostgreSQL cannot store, by U+FFFD.
std::string database_text(std::string_view text);

/// JSON text for a column of type jsonb: database_text() of every string and name; numbers that are not finite become
/// null.
std::string jsonb_text(const nlohmann::json& value);

/// Appends a quoted CSV field for COPY: database_text() of at most `max` bytes, without a partial character.
void append_quoted(std::string& csv, std::string_view text, std::size_t max = std::string_view::npos);

}  // namespace prism::prismrelay
