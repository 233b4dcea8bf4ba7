// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/task_command.hpp"

#include <fmt/format.h>

namespace prism::campaign {

std::string shell_quoted(const std::string& text) {
  if (!text.empty() &&
      text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./:,@%") ==
          std::string::npos)
    return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string task_command(const CampaignFile& file, const std::string& program, const std::string& id) {
  return fmt::format("{} campaign {} --task {}", shell_quoted(program), shell_quoted(file.path), id);
}

}  // namespace prism::campaign
