// SPDX-License-Identifier: MIT
// The options of a command as a table. The lines of --help, the completions made from it, and the options in the file
// of a lot (campaign) come from the same rows.
#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace prism::commands {

enum class Need {
  kUsual,
  kRequired,
  kFew,  ///< few users need it: in the second section of --help
};

/// `flag`: "--out", or "recordings" for an argument. `member` is where the value is stored; its value is the default,
/// shown if it is a text or a number other than 0. A bool is a flag.
struct OptionRow {
  const char* flag;
  std::variant<bool*, std::string*, double*, int*, std::uint64_t*, std::optional<double>*, std::vector<std::string>*>
      member;
  std::string help;
  std::optional<CLI::Validator> check{};  ///< its range (tools/command_line.hpp) or its names (one_of())
};

CLI::Validator one_of(std::vector<std::string> names);

/// Adds all rows; returns their options in this order.
std::vector<CLI::Option*> add_options(CLI::App& command, const std::vector<OptionRow>& rows, Need need = Need::kUsual);

}  // namespace prism::commands
