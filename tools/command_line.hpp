// SPDX-License-Identifier: MIT
// Shared parts of the tools' command lines: checks of numbers and readable help.
#pragma once

#include <CLI/App.hpp>
#include <CLI/Config.hpp>  // App alone is declared by what these two define
#include <CLI/Formatter.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/outside_text.hpp"

namespace prism::tools {

/// Accepts numbers from `least` to `most`. Rejects "nan", which CLI::Range and CLI::PositiveNumber accept.
CLI::Validator within(double least, double most, const std::string& expected);
CLI::Validator within(double least, double most);
CLI::Validator positive();
CLI::Validator not_negative();

/// Accepts names and texts that follow the rule.
CLI::Validator following(TextRule rule);

/// Gives `app` and its later subcommands a help in which each option has one word for its value, and its range and
/// default in parentheses after the description. The choices of an option must be written in its description.
void use_readable_help(CLI::App& app);

/// Adds examples to the end of a command's help, one command per line.
void add_examples(CLI::App& command, const std::vector<std::string>& lines);

/// Parses the command line of `program`. Returns the exit code after its help, its version or an error, for which it
/// prints a line (64); else nullopt.
std::optional<int> parse(CLI::App& app, const char* program, int argc, char** argv);

}  // namespace prism::tools
