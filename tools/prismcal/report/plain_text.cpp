// SPDX-License-Identifier: MIT
#include "tools/prismcal/report/plain_text.hpp"

#include <algorithm>

namespace prism::report {
namespace {

/// Characters of UTF-8: bytes that do not continue one.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

void append_padded(std::string& line, const std::string& text, std::size_t width, bool right) {
  const std::string space(width - std::min(width, width_of(text)), ' ');
  line += right ? space + text : text + space;
}

void append_line(std::string& text, std::string line) {
  while (!line.empty() && line.back() == ' ') line.pop_back();
  text += line + "\n";
}

}  // namespace

std::string plain_text(const Table& table) {
  std::vector<std::size_t> widths;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    std::size_t width = std::max(width_of(table.columns[i].name), width_of(table.columns[i].unit));
    for (const auto& row : table.rows) width = std::max(width, width_of(row[i].text));
    widths.push_back(width);
  }
  std::string text = table.title + "\n";
  for (const bool units : {false, true}) {
    std::string line;
    for (std::size_t i = 0; i < widths.size(); ++i) {
      const Column& column = table.columns[i];
      append_padded(line, units ? column.unit : column.name, widths[i], column.number);
      line += "  ";
    }
    append_line(text, line);
  }
  for (const auto& row : table.rows) {
    std::string line;
    for (std::size_t i = 0; i < widths.size(); ++i) {
      append_padded(line, row[i].text, widths[i], table.columns[i].number);
      line += "  ";
    }
    append_line(text, line);
  }
  return text + (table.caption.empty() ? "" : table.caption + "\n");
}

}  // namespace prism::report
