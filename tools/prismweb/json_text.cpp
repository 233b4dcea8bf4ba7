// SPDX-License-Identifier: MIT
#include "tools/prismweb/json_text.hpp"

namespace prism::prismweb {

nlohmann::json parse_message(std::string_view text) {
  using nlohmann::json;
  constexpr int kMaxDepth = 32;
  bool is_too_deep = false;
  const auto watch = [&](int depth, json::parse_event_t event, json&) {
    const bool is_start = event == json::parse_event_t::array_start || event == json::parse_event_t::object_start;
    is_too_deep = is_too_deep || (is_start && depth >= kMaxDepth);  // the outermost one begins at depth 0
    return !is_too_deep;
  };
  json value = json::parse(text, watch, false);
  return is_too_deep || value.is_discarded() ? json() : value;
}

}  // namespace prism::prismweb
