// SPDX-License-Identifier: MIT
// The configured instances of this host.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/prismrelay/settings.hpp"
#include "tools/prismrelay/state.hpp"

namespace prism::prismrelay {

/// Returns name → socket path of client::list_instances(), the first of equal names; logs each invalid name once.
std::map<std::string, std::string> find_instances(const std::vector<std::string>& entries, RelayState& state);

/// Calls add(gyro, name, socket) for each instance that is not in `sources`, which has them by gyro. Closes and removes
/// those that are neither configured nor running, after remove(source).
template <class Sources, class Add, class Remove>
void update_sources(Sources& sources, const Settings& settings, RelayState& state, Add&& add, Remove&& remove) {
  const auto found = find_instances(settings.instances, state);
  for (const auto& [name, socket] : found) {
    const std::string gyro = settings.site + "/" + name;
    if (sources.count(gyro) == 0) add(gyro, name, socket);
  }
  for (auto at = sources.begin(); at != sources.end();) {
    const std::string name = at->first.substr(settings.site.size() + 1);
    if (found.count(name) != 0 || at->second.instance->running()) {
      ++at;
      continue;
    }
    at->second.instance->close();
    remove(at->second);
    state.forget(at->first);
    at = sources.erase(at);
  }
}

}  // namespace prism::prismrelay
