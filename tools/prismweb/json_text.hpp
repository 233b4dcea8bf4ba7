// SPDX-License-Identifier: MIT
// JSON text that prismweb sends and receives.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/escape.hpp"
#include "base/json_member.hpp"

namespace prism::prismweb {

/// json_text() of base/escape.hpp, also for a braced initialiser.
inline std::string json_text(const nlohmann::json& value) { return prism::json_text(value); }

/// Parses a client's message. Returns JSON null if it is invalid or has more than 32 levels.
inline nlohmann::json parse_message(std::string_view text) {
  return parse_json_line(text, 32).value_or(nlohmann::json());
}

}  // namespace prism::prismweb
