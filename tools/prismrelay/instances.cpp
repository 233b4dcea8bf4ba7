// SPDX-License-Identifier: MIT
#include "tools/prismrelay/instances.hpp"

#include "base/escape.hpp"
#include "base/outside_text.hpp"
#include "config/socket_path.hpp"
#include "tools/prismrelay/state.hpp"

namespace prism::prismrelay {

std::map<std::string, std::string> find_instances(const std::vector<std::string>& entries,
                                                  std::vector<std::string>* invalid) {
  std::map<std::string, std::string> found;
  for (const std::string& entry : entries) {
    if (entry.ends_with('/')) {
      for (const std::string& path : config::sockets_in(entry, invalid))
        found.try_emplace(config::instance_name(path), path);
      continue;
    }
    const bool is_path = entry.find('/') != std::string::npos;
    const std::string path = is_path ? entry : config::socket_folders().front() + "/" + entry + ".sock";
    if (follows(TextRule::kName, config::instance_name(path))) {
      found.try_emplace(config::instance_name(path), path);
    } else if (invalid != nullptr) {
      invalid->push_back(printable(path));
    }
  }
  return found;
}

std::map<std::string, std::string> find_instances(const std::vector<std::string>& entries, RelayState& state) {
  std::vector<std::string> invalid;
  auto found = find_instances(entries, &invalid);
  for (const std::string& path : invalid)
    state.log_skipped(path, std::string("expected a name of ") + rule_text(TextRule::kName));
  return found;
}

}  // namespace prism::prismrelay
