// SPDX-License-Identifier: MIT
// A batch of what prismd sends by itself, read again for programs that take it in another form.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace prism::prismweb {

/// A notification, its params without what is not known (null).
struct BatchRow {
  std::string method;
  nlohmann::json params;
};

struct Batch {
  std::string instance;
  std::vector<BatchRow> rows;
};

/// Of a text {"instance":…,"batch":[…]}; no rows where it is something else.
Batch read_batch(const std::string& text);

}  // namespace prism::prismweb
