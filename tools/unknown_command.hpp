// SPDX-License-Identifier: MIT
// A mistyped command of a program that has several, told by its name.
#pragma once

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <string>
#include <vector>

#include "compensation/plain_text.hpp"

namespace prism::tools {

/// Of a program with commands: what to say where its first word is none of them; empty where it is one, or where there
/// is no word. CLI11 itself would say only that a command is required.
inline std::string unknown_command(const CLI::App& app, int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.size() < 2 || word[0] != '-') {
      std::vector<std::string> names;
      for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
        if (command->check_name(word)) return "";
        names.push_back(command->get_name());
      }
      const std::string near = nearest_name(word, names);
      if (!near.empty()) return fmt::format("found the command \"{}\", did you mean \"{}\"?", plain_text(word), near);
      return fmt::format("found the command \"{}\", expected one of: {}", plain_text(word), fmt::join(names, ", "));
    }
    const CLI::Option* option = word == "-" ? nullptr : app.get_option_no_throw(word);
    if (option != nullptr && option->get_type_size() > 0) ++i;  // its value is no command
  }
  return "";
}

}  // namespace prism::tools
