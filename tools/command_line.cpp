// SPDX-License-Identifier: MIT
#include "tools/command_line.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <limits>
#include <regex>

#include "compensation/plain_text.hpp"

namespace prism::tools {
namespace {

// One word for the value beside the option's name; bounds and default in words behind the description. The words of a
// choice stand in the description, written by hand.
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

void speak_to_people(CLI::App& app) { app.formatter(std::make_shared<HelpText>()); }

void add_examples(CLI::App& command, const std::vector<std::string>& lines) {
  command.footer(fmt::format("Examples:\n  {}", fmt::join(lines, "\n  ")));
}

std::string unknown_command(const CLI::App& app, int argc, char** argv) {
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
