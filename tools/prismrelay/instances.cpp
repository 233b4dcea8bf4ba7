// SPDX-License-Identifier: MIT
#include "tools/prismrelay/instances.hpp"

#include "base/outside_text.hpp"
#include "tools/client/instances.hpp"

namespace prism::prismrelay {

std::map<std::string, std::string> find_instances(const std::vector<std::string>& entries, RelayState& state) {
  std::vector<std::string> invalid;
  std::map<std::string, std::string> found;
  for (const auto& [name, path] : client::list_instances(entries, &invalid)) found.try_emplace(name, path);
  for (const std::string& path : invalid)
    state.log_skipped(path, std::string("expected a name of ") + rule_text(TextRule::kName));
  return found;
}

}  // namespace prism::prismrelay
