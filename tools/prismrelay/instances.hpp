// SPDX-License-Identifier: MIT
// The configured instances of this host.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace prism::prismrelay {

/// Returns name → socket path. `entries` are names, sockets, or directories ending in '/'. A name or socket is listed
/// even if it does not exist; a directory is searched for sockets. The first of equal names is listed. Paths whose
/// names do not follow TextRule::kName are not listed, but added to `invalid`, if given, as printable text.
std::map<std::string, std::string> find_instances(const std::vector<std::string>& entries,
                                                  std::vector<std::string>* invalid = nullptr);

class RelayState;

/// The same; logs each invalid name once.
std::map<std::string, std::string> find_instances(const std::vector<std::string>& entries, RelayState& state);

}  // namespace prism::prismrelay
