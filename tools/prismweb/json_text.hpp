// SPDX-License-Identifier: MIT
// JSON values as the text that goes out, and what comes in.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace prism::prismweb {

/// A value as text; whatever bytes came in, UTF-8 goes out.
inline std::string dumped(const nlohmann::json& value) {
  return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// A member's text; empty where it is none, or `object` no object.
inline std::string text_of(const nlohmann::json& object, const char* key) {
  if (!object.is_object()) return "";
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

}  // namespace prism::prismweb
