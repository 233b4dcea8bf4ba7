// SPDX-License-Identifier: MIT
// The instances of this host that the relay was told to follow.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace prism::prismrelay {

/// Name → path of the socket, of what is there now: `entries` are names, sockets, or folders ending in '/'. Names and
/// sockets are listed whether they are there or not. Of two with one name the first counts. Paths whose names do not
/// follow TextRule::kName are not listed: they are added to `invalid`, if given, as printable text.
std::map<std::string, std::string> find_instances(const std::vector<std::string>& entries,
                                                  std::vector<std::string>* invalid = nullptr);

class RelayState;

/// The same; invalid names are logged once.
std::map<std::string, std::string> find_instances(const std::vector<std::string>& entries, RelayState& state);

}  // namespace prism::prismrelay
