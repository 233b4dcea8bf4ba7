// SPDX-License-Identifier: MIT
#include "tools/prismweb/json_text.hpp"

namespace prism::prismweb {

nlohmann::json parse_message(std::string_view text) {
  using nlohmann::json;
  constexpr int kMaxDepth = 32;
  bool is_too_deep = false;
  const auto watch = [&](int depth, json::parse_event_t, json&) {
    is_too_deep = is_too_deep || depth > kMaxDepth;
    return !is_too_deep;
  };
  json value = json::parse(text, watch, false);
  return is_too_deep || value.is_discarded() ? json() : value;
}

}  // namespace prism::prismweb
