// SPDX-License-Identifier: MIT
// Strictly parsed JSON text with the line of each key.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace prism {

/// Keys stay in the order of the text.
using Json = nlohmann::ordered_json;

struct JsonDocument {
  Json value;                            ///< an object
  std::string where;                     ///< the file, for error messages
  std::vector<std::uint32_t> key_lines;  ///< the line of every key, in the order of the text; empty: unknown

  /// The line of a key of `object`, which is a part of `value`; 0: unknown.
  std::uint32_t line_of(const Json& object, const std::string& key) const;
};

/// JSON text (comments allowed) → document. Errors: invalid JSON (file:line:column), a key given twice in one object,
/// more than 32 levels, 10 000 keys in one object or 20 million values, and anything but an object at the top.
Result<JsonDocument> parse_json_object(std::string_view text, std::string_view where);

/// A value in an error message: its text, at most 40 characters.
template <class AnyJson>
std::string shown(const AnyJson& value) {
  const std::string text = value.dump(-1, ' ', true, AnyJson::error_handler_t::replace);
  return text.size() > 40 ? text.substr(0, 37) + "..." : text;
}

}  // namespace prism
