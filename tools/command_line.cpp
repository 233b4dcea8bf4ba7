// SPDX-License-Identifier: MIT
#include "tools/command_line.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <limits>

#include "base/escape.hpp"
#include "base/plain_text.hpp"

namespace prism::tools {
namespace {

// Returns the range in a type name with the text of within() below, like "INT:within 1 to 256".
std::string bounds_of(const std::string& type) {
  const std::string check = type.substr(type.rfind(':') + 1);
  if (check.starts_with("within ")) return check.substr(7);
  if (check.starts_with("above ")) return check;
  return check == "of 0 or more" ? "0 or more" : "";
}

// Formats an option: one word for its value; range and default after the description.
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
    const std::string bounds = bounds_of(option->get_type_name());
    if (!bounds.empty()) facts.push_back(bounds);
    if (!option->get_default_str().empty()) facts.push_back("default " + option->get_default_str());
    for (const CLI::Option* other : option->get_excludes()) facts.push_back("not with " + other->get_name());
    return option->get_description() + (facts.empty() ? "" : fmt::format(" ({})", fmt::join(facts, "; ")));
  }
};

// An error text if the first word is not a command of the program; empty if it is one, if there is no word, or if the
// program has no commands. CLI11 would only report that a command is required.
std::string unknown_command(const CLI::App& app, int argc, char** argv) {
  if (app.get_require_subcommand_min() == 0) return "";
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
    if (option != nullptr && option->get_type_size() > 0) ++i;  // its value is not a command
  }
  return "";
}

}  // namespace

CLI::Validator within(double least, double most, const std::string& expected) {
  const auto check = [least, most, expected](std::string& word) {
    char* end = nullptr;
    const double number = std::strtod(word.c_str(), &end);
    if (!word.empty() && *end == '\0' && number >= least && number <= most) return std::string();
    return fmt::format("found \"{}\", expected a number {}", word, expected);
  };
  return CLI::Validator(check, expected);
}

CLI::Validator within(double least, double most) {
  return within(least, most, fmt::format("within {} to {}", least, most));
}

CLI::Validator positive() {
  return within(std::numeric_limits<double>::min(), std::numeric_limits<double>::max(), "above 0");
}

CLI::Validator not_negative() { return within(0, std::numeric_limits<double>::max(), "of 0 or more"); }

CLI::Validator following(TextRule rule) {
  const auto check = [rule](std::string& word) {
    if (follows(rule, word)) return std::string();
    return fmt::format("found \"{}\", expected {}", shortened(word), rule_text(rule));
  };
  return CLI::Validator(check, "");
}

void use_readable_help(CLI::App& app) { app.formatter(std::make_shared<HelpText>()); }

void add_examples(CLI::App& command, const std::vector<std::string>& lines) {
  command.footer(fmt::format("Examples:\n  {}", fmt::join(lines, "\n  ")));
}

std::optional<int> parse(CLI::App& app, const char* program, int argc, char** argv) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::string what = unknown_command(app, argc, argv);
    if (what.empty()) what = fmt::format("{}; see {} --help", error.what(), program);
    fmt::print(stderr, "{}: {}\n", program, printable(what));
    return 64;
  }
  return std::nullopt;
}

}  // namespace prism::tools
