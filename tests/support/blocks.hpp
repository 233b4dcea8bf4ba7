// SPDX-License-Identifier: MIT
// Data of tests: blocks of lines in a text file, separated by empty lines; lines that begin with # are comments.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace prism::test {

struct Block {
  std::string where;  ///< file:line of its first line
  std::vector<std::string> lines;

  const std::string& operator[](std::size_t i) const { return lines.at(i); }

  /// A line as a text in quotes, with the escapes \n, \r, \\ and \xHH.
  std::string text(std::size_t i) const {
    const std::string& line = lines.at(i);
    EXPECT_TRUE(line.size() > 1 && line.front() == '"' && line.back() == '"') << where << ": no quotes: " << line;
    std::string text;
    for (std::size_t at = 1; at + 1 < line.size(); ++at) {
      if (line[at] != '\\') {
        text += line[at];
      } else if (line[++at] == 'x') {
        text += static_cast<char>(std::stoi(line.substr(at + 1, 2), nullptr, 16));
        at += 2;
      } else {
        text += line[at] == 'n' ? '\n' : line[at] == 'r' ? '\r' : line[at];
      }
    }
    return text;
  }
};

/// The blocks of tests/unit/`name`. The test fails without any, or if one has not `lines` lines, or fewer than
/// -`lines` if that is negative.
inline std::vector<Block> blocks(const std::string& name, int lines) {
  std::ifstream in(std::filesystem::path(PRISM_SOURCE_DIR) / "tests/unit" / name);
  std::vector<Block> all;
  bool in_block = false;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (line.starts_with('#')) continue;
    if (!line.empty() && !in_block) all.push_back({name + ":" + std::to_string(number), {}});
    in_block = !line.empty();
    if (in_block) all.back().lines.push_back(line);
  }
  EXPECT_FALSE(all.empty()) << name << " has no block";
  std::erase_if(all, [lines](const Block& block) {
    const int found = static_cast<int>(block.lines.size());
    const bool wrong = lines < 0 ? found < -lines : found != lines;
    EXPECT_FALSE(wrong) << block.where << ": a block of " << found << " lines, expected "
                        << (lines < 0 ? "at least " : "") << std::abs(lines);
    return wrong;
  });
  return all;
}

}  // namespace prism::test
