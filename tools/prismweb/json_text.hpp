// SPDX-License-Identifier: MIT
// JSON values as the text that prismweb sends, and members of values that it receives.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/escape.hpp"

namespace prism::prismweb {

/// json_text() of base/escape.hpp, also for a value that is written in braces.
inline std::string json_text(const nlohmann::json& value) { return prism::json_text(value); }

/// A member's text; empty if it is no text, or `object` no object.
inline std::string text_of(const nlohmann::json& object, const char* key) {
  if (!object.is_object()) return "";
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

/// Parses a client's message. Returns null (JSON) if it is no JSON, or nested deeper than 32 levels: what copies or
/// writes such a value calls itself once for each level.
nlohmann::json parse_message(std::string_view text);

}  // namespace prism::prismweb
