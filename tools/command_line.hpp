// SPDX-License-Identifier: MIT
// What the command lines of the tools share: numbers within bounds, and help that people can read.
#pragma once

#include <CLI/App.hpp>
#include <CLI/Config.hpp>  // App alone is declared by what these two define
#include <CLI/Formatter.hpp>
#include <string>
#include <vector>

#include "base/outside_text.hpp"

namespace prism::tools {

/// Refuses what is no number from `least` to `most`, "nan" too, which CLI::Range and CLI::PositiveNumber let through.
CLI::Validator within(double least, double most, const std::string& expected);
CLI::Validator within(double least, double most);
CLI::Validator positive();
CLI::Validator not_negative();

/// Accepts what follows the rule for names and texts.
CLI::Validator following(TextRule rule);

/// Gives `app` and its later subcommands a help with one word for the value beside the option's name, and bounds and
/// default in words behind the description. The words of a choice stand in the description, written by hand.
void speak_to_people(CLI::App& app);

/// The last lines of a command's help: commands as a person would type them, a line each.
void add_examples(CLI::App& command, const std::vector<std::string>& lines);

/// Of a program with commands: what to say where its first word is none of them; empty where it is one, or where there
/// is no word. CLI11 itself would say only that a command is required.
std::string unknown_command(const CLI::App& app, int argc, char** argv);

}  // namespace prism::tools
