// SPDX-License-Identifier: MIT
// Parses batches of notifications, to convert them for Foxglove and PlotJuggler.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace prism::prismweb {

/// A notification. Members that are null (unknown) are removed from `params`.
struct BatchRow {
  std::string method;
  nlohmann::json params;
};

struct Batch {
  std::string instance;
  std::vector<BatchRow> rows;
};

/// Parses {"instance":…,"batch":[…]}. Returns no rows for any other text.
Batch read_batch(const std::string& text);

}  // namespace prism::prismweb
