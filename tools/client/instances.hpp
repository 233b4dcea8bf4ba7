// SPDX-License-Identifier: MIT
// The instances of this host: one rule for all programs.
#pragma once

#include <string>
#include <vector>

namespace prism::client {

struct InstanceSocket {
  std::string name, path;

  bool operator==(const InstanceSocket&) const = default;
};

/// Returns the instances that `entries` name: a name, a socket, or a directory ending in '/' for all its sockets; of
/// all config::socket_folders() if `entries` is empty. A name is searched in these folders; one that is in none is
/// listed at config::default_socket(). Of equal names, programs use the first. Names that do not follow TextRule::kName
/// are not listed, but added to `invalid`, if given, as printable paths.
std::vector<InstanceSocket> list_instances(const std::vector<std::string>& entries,
                                           std::vector<std::string>* invalid = nullptr);

}  // namespace prism::client
