// SPDX-License-Identifier: MIT
// Reads tables and examples from the documents, so that tests can compare them with the code.
#pragma once

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/shared_files.hpp"

namespace prism::test {

/// docs/NAME from the line that begins with `heading` to the next heading of the same depth or above.
inline std::string document_section(const std::string& name, const std::string& heading) {
  std::istringstream in(read_file(std::filesystem::path(PRISM_SOURCE_DIR) / "docs" / name));
  const auto depth = [](const std::string& line) { return line.find_first_not_of('#'); };
  std::string section;
  bool inside = false, fenced = false;
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("```", 0) == 0) fenced = !fenced;
    const bool is_heading = !fenced && line.rfind('#', 0) == 0;
    if (inside && is_heading && depth(line) <= depth(heading)) break;
    if (line == heading) inside = true;
    if (inside) section += line + "\n";
  }
  return section;
}

/// The inside of the first ```KIND block of a section.
inline std::string fenced_block(const std::string& section, const std::string& kind) {
  const std::string open = "```" + kind + "\n";
  const std::size_t begin = section.find(open);
  if (begin == std::string::npos) return "";
  const std::size_t first = begin + open.size();
  return section.substr(first, section.find("```", first) - first);
}

/// The table whose first column is called `first`: one vector of cells a row, without backticks.
inline std::vector<std::vector<std::string>> table(const std::string& section, const std::string& first) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream in(
      section.substr(std::min({section.find("| " + first + " |"), section.find("|" + first + "|"), section.size()})));
  for (std::string line; std::getline(in, line) && line.rfind('|', 0) == 0;) {
    std::vector<std::string> cells;
    std::istringstream fields(line.substr(1));
    for (std::string cell; std::getline(fields, cell, '|');) {
      const std::size_t begin = cell.find_first_not_of(" `"), end = cell.find_last_not_of(" `");
      cells.push_back(begin == std::string::npos ? "" : cell.substr(begin, end - begin + 1));
    }
    rows.push_back(cells);
  }
  rows.erase(rows.begin(), rows.begin() + std::min<std::ptrdiff_t>(2, std::ssize(rows)));
  return rows;
}

}  // namespace prism::test
