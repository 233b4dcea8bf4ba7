// SPDX-License-Identifier: MIT
#include "tools/prismcal/option_table.hpp"

#include <type_traits>

#include "tools/command_line.hpp"

namespace prism::commands {
namespace {

template <class Value>
CLI::Option* add_value(CLI::App& command, const OptionRow& row, Value& value) {
  if constexpr (std::is_same_v<Value, bool>) {
    return command.add_flag(row.flag, value, row.help);
  } else {
    CLI::Option* option = command.add_option(row.flag, value, row.help);
    if constexpr (std::is_arithmetic_v<Value> || std::is_same_v<Value, std::string>) {
      if (value != Value()) option->capture_default_str();
    }
    return option;
  }
}

}  // namespace

CLI::Validator one_of(std::vector<std::string> names) { return CLI::IsMember(std::move(names)); }

std::vector<CLI::Option*> add_options(CLI::App& command, const std::vector<OptionRow>& rows, Need need) {
  std::vector<CLI::Option*> options;
  for (const OptionRow& row : rows) {
    options.push_back(std::visit([&](auto* value) { return add_value(command, row, *value); }, row.member));
    if (row.check) options.back()->check(*row.check);
    if (need == Need::kRequired) options.back()->required();
    if (need == Need::kFew) options.back()->group("Further options");
  }
  return options;
}

}  // namespace prism::commands
