// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/csv_lines.hpp"

namespace prism::recordings {
namespace {

std::string_view trimmed(std::string_view text) {
  const auto dropped = [](char c) { return c == ' ' || c == '"' || c == '\r'; };
  while (!text.empty() && dropped(text.front())) text.remove_prefix(1);
  while (!text.empty() && dropped(text.back())) text.remove_suffix(1);
  return text;
}

}  // namespace

std::optional<std::string_view> csv_field(std::string_view line, char separator, std::size_t index) {
  for (; index > 0; --index) {
    const std::size_t end = line.find(separator);
    if (end == std::string_view::npos) return std::nullopt;
    line.remove_prefix(end + 1);
  }
  return trimmed(line.substr(0, line.find(separator)));
}

std::vector<std::string> csv_fields(std::string_view line, char separator) {
  std::vector<std::string> fields;
  for (std::size_t i = 0; !line.empty(); ++i) {
    const auto field = csv_field(line, separator, i);
    if (!field) break;
    fields.emplace_back(*field);
  }
  return fields;
}

}  // namespace prism::recordings
