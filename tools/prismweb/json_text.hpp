// SPDX-License-Identifier: MIT
// JSON values as the text that goes out.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace prism::prismweb {

/// A value as text; whatever bytes came in, UTF-8 goes out.
inline std::string dumped(const nlohmann::json& value) {
  return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace prism::prismweb
