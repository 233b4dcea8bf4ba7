// SPDX-License-Identifier: MIT
// Tests as scripts: a text file of commands, each followed by the lines that it gives, indented by two blanks. An empty
// line ends a script; lines that begin with # are comments.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/shared_files.hpp"

namespace prism::test {

/// Runs the scripts of tests/unit/`name`, each with a Player of its own: its play(command, words) gets the first word
/// and the stream of the others, and returns lines. With PRISM_REGENERATE=1 these are written to the file: read them.
template <class Player>
void expect_scripts(const std::string& name) {
  const std::filesystem::path file = std::filesystem::path(PRISM_SOURCE_DIR) / "tests/unit" / name;
  std::istringstream in(read_file(file));
  std::unique_ptr<Player> player;
  std::string written, expected, found, where, about;
  int number = 0, scripts = 0;
  const auto end = [&] {
    if (!player) return;
    player.reset();
    ++scripts;
    EXPECT_EQ(found, expected) << where << ": " << about;
    written += found;
    found.clear(), expected.clear();
  };
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (line.empty() || line[0] == '#') {
      if (line.empty()) end();
      (player ? found : written) += line + "\n";
      if (player) expected += line + "\n";
      about = line;
      continue;
    }
    expected += line + "\n";
    if (line.starts_with("  ")) continue;
    if (!player) {
      player = std::make_unique<Player>();
      where = name + ":" + std::to_string(number);
    }
    found += line + "\n";
    std::istringstream words(line);
    std::string command;
    words >> command;
    for (const std::string& given : player->play(command, words)) found += "  " + given + "\n";
  }
  end();
  EXPECT_GT(scripts, 0) << name << " has no script";
  if (std::getenv("PRISM_REGENERATE") != nullptr) std::ofstream(file) << written;
}

/// The next word as a T; `otherwise` at the end of the line.
template <class T>
T next(std::istream& words, T otherwise = {}) {
  T value;
  return words >> value ? value : otherwise;
}

/// The rest of the line without its first blank, with \n for the end of a line and x*3 for xxx.
inline std::string rest_of(std::istream& words) {
  std::string line, text;
  std::getline(words >> std::ws, line);
  for (std::size_t i = 0; i < line.size(); ++i) {
    const bool escaped = line[i] == '\\' && i + 1 < line.size() && line[i + 1] == 'n';
    if (escaped) {
      text += '\n', ++i;
    } else if (line[i] == '*' && i > 0 && i + 1 < line.size() && std::isdigit(line[i + 1])) {
      std::size_t digits = 0;
      const int times = std::stoi(line.substr(i + 1), &digits);
      text.append(static_cast<std::size_t>(times - 1), line[i - 1]), i += digits;
    } else {
      text += line[i];
    }
  }
  return text;
}

}  // namespace prism::test
