// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/task_command.hpp"

#include <fmt/format.h>

#include "base/escape.hpp"

namespace prism::campaign {

std::string task_command(const CampaignFile& file, const std::string& program, const std::string& id) {
  return fmt::format("{} campaign {} --task {}", shell_word(program), shell_word(file.path), id);
}

}  // namespace prism::campaign
