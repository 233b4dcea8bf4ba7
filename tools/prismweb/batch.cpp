// SPDX-License-Identifier: MIT
#include "tools/prismweb/batch.hpp"

#include <iterator>
#include <utility>

#include "tools/prismweb/json_text.hpp"

namespace prism::prismweb {

Batch read_batch(const std::string& text) {
  using nlohmann::json;
  const json parsed = json::parse(text, nullptr, false);
  if (!parsed.is_object() || !parsed.contains("batch") || !parsed["batch"].is_array()) return {};
  Batch batch{text_member(parsed, "instance"), {}};
  for (const json& notification : parsed["batch"]) {
    json params = notification.is_object() ? notification.value("params", json()) : json();
    if (!params.is_object()) continue;
    for (auto member = params.begin(); member != params.end();)
      member = member->is_null() ? params.erase(member) : std::next(member);
    batch.rows.push_back({text_member(notification, "method"), std::move(params)});
  }
  return batch;
}

}  // namespace prism::prismweb
