// SPDX-License-Identifier: MIT
// The instances of this host that the relay was told to follow.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace prism::prismrelay {

/// Name → path of the socket, of what is there now: `entries` are names, sockets, or folders ending in '/'. Names and
/// sockets are listed whether they are there or not. Of two with one name the first counts.
std::map<std::string, std::string> find_instances(const std::vector<std::string>& entries);

}  // namespace prism::prismrelay
