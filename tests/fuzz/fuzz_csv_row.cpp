// SPDX-License-Identifier: MIT
// Any bytes as a row of the log: rejected in one line of ASCII, or a row whose text parses to the same text and whose
// JSON is valid.
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "compensation/compensated_text.hpp"
#include "tests/fuzz/require.hpp"

namespace {

std::string csv(const prism::compensation::CompensatedWindow& row) {
  std::string text;
  prism::compensation::append_csv(text, row);
  return text;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto row = prism::compensation::parse_csv({reinterpret_cast<const char*>(data), size}, "fuzz.csv:1");
  if (!row) {
    const std::string line = row.error().text();
    require(line.size() < 200);
    for (const char c : line) require(c >= 0x20 && c <= 0x7e);
    return 0;
  }
  const std::string text = csv(*row);
  const auto again = prism::compensation::parse_csv(text, "again.csv:1");
  require(again.has_value());
  require(csv(*again) == text);
  std::string json;
  prism::compensation::append_json(json, *row);
  require(nlohmann::json::accept(json));
  return 0;
}
