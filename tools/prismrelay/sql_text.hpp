// SPDX-License-Identifier: MIT
// Text and JSON as PostgreSQL accepts them, and as fields of its CSV.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace prism::prismrelay {

/// Valid UTF-8 without NUL: PostgreSQL stores neither. Both become U+FFFD.
std::string database_text(std::string_view text);

/// JSON text for a column of type jsonb: database_text() in every text and name, null for what is not finite.
std::string jsonb_text(const nlohmann::json& value);

/// Appends a field of CSV for COPY, quoted: database_text() of at most `max` bytes, complete characters.
void append_quoted(std::string& csv, std::string_view text, std::size_t max = std::string_view::npos);

}  // namespace prism::prismrelay
