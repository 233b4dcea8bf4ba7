// SPDX-License-Identifier: MIT
#include "daemon/socket/row_text.hpp"

#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "compensation/compensated_text.hpp"

namespace prism::socket {

std::string row_head(std::string_view axis) { return R"({"axis":)" + json_text(nlohmann::json(axis)); }

// Replaces the row's '{' by a comma.
char* put_row(char* at, std::string_view head, const compensation::Compensated& row) {
  char* const comma = std::copy_n(head.data(), head.size(), at);
  char* const end = compensation::put_json(comma, row);
  *comma = ',';
  return end;
}

void append_row(std::string& text, std::string_view axis, const compensation::CompensatedWindow& row) {
  text += row_head(axis);
  const std::size_t comma = text.size();
  compensation::append_json(text, row);
  text[comma] = ',';
}

}  // namespace prism::socket
