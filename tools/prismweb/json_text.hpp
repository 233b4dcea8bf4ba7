// SPDX-License-Identifier: MIT
// JSON values as the text that prismweb sends, and the messages that it receives.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/escape.hpp"
#include "base/json_member.hpp"

namespace prism::prismweb {

/// json_text() of base/escape.hpp, also for a value that is written in braces.
inline std::string json_text(const nlohmann::json& value) { return prism::json_text(value); }

/// A client's message of at most 32 levels; null (JSON) if the text is not such JSON.
inline nlohmann::json parse_message(std::string_view text) {
  return parse_json_line(text, 32).value_or(nlohmann::json());
}

}  // namespace prism::prismweb
