// SPDX-License-Identifier: MIT
// What the command lines of the tools share: numbers within bounds, and help that people can read.
#pragma once

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cstdlib>
#include <limits>
#include <regex>
#include <string>
#include <vector>

namespace prism::tools {

/// Refuses what is no number from `least` to `most`, "nan" too, which CLI::Range and CLI::PositiveNumber let through.
inline CLI::Validator within(double least, double most, const std::string& expected) {
  const auto check = [least, most, expected](std::string& word) {
    char* end = nullptr;
    const double number = std::strtod(word.c_str(), &end);
    if (!word.empty() && *end == '\0' && number >= least && number <= most) return std::string();
    return fmt::format("found \"{}\", expected a number {}", word, expected);
  };
  return CLI::Validator(check, expected);
}

inline CLI::Validator within(double least, double most) {
  return within(least, most, fmt::format("within {} to {}", least, most));
}
inline CLI::Validator positive() {
  return within(std::numeric_limits<double>::min(), std::numeric_limits<double>::max(), "above 0");
}
inline CLI::Validator not_negative() { return within(0, std::numeric_limits<double>::max(), "of 0 or more"); }

/// One word for the value beside the option's name; bounds and default in words behind the description. The words of a
/// choice stand in the description, written by hand.
class HelpText : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override {
    if (option->get_type_size() == 0) return "";
    const std::string type = option->get_type_name().substr(0, option->get_type_name().find(':'));
    const std::string word = type == "INT" || type == "UINT" ? "N"
                             : type == "FLOAT"               ? "NUMBER"
                             : type == "ENUM"                ? "TEXT"
                                                             : type;
    const bool many = option->get_expected_max() == CLI::detail::expected_max_vector_size;
    return (word.empty() ? "" : " " + word) + (many ? "..." : "");
  }

  std::string make_option_desc(const CLI::Option* option) const override {
    std::vector<std::string> facts;
    if (option->get_required() && !option->get_positional()) facts.push_back("required");
    const std::string type = option->get_type_name();
    std::smatch bounds;
    if (std::regex_search(
            type, bounds,
            std::regex(R"(:(?:\w+ in \[(\S+) - (\S+)\]|within (\S+ to \S+)|(above \S+)|of (0 or more))$)"))) {
      facts.push_back(bounds[1].matched ? bounds.str(1) + " to " + bounds.str(2)
                                        : bounds.str(3) + bounds.str(4) + bounds.str(5));
    }
    if (!option->get_default_str().empty()) facts.push_back("default " + option->get_default_str());
    for (const CLI::Option* other : option->get_excludes()) facts.push_back("not with " + other->get_name());
    return option->get_description() + (facts.empty() ? "" : fmt::format(" ({})", fmt::join(facts, "; ")));
  }
};

/// Gives `app` and its later subcommands this help.
inline void speak_to_people(CLI::App& app) { app.formatter(std::make_shared<HelpText>()); }

/// The last lines of a command's help: commands as a person would type them, a line each.
inline void add_examples(CLI::App& command, const std::vector<std::string>& lines) {
  command.footer(fmt::format("Examples:\n  {}", fmt::join(lines, "\n  ")));
}

}  // namespace prism::tools
