// SPDX-License-Identifier: MIT
// The instances of this host: one rule for all programs.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::client {

struct InstanceSocket {
  std::string name, path;

  bool operator==(const InstanceSocket&) const = default;
};

/// Why `entries` of a configuration are wrong, in one line: an empty one, an invalid name, or two of one name.
std::optional<std::string> instances_error(const std::vector<std::string>& entries);

/// Returns the instances that `entries` name: a name, a socket, or a directory ending in '/' for all its sockets; of
/// all config::socket_folders() if `entries` is empty. A name is searched in these folders; one that is in none is
/// listed at config::default_socket(). Of equal names, programs use the first. Names that do not follow TextRule::kName
/// are not listed, but added to `invalid`, if given, as printable paths.
std::vector<InstanceSocket> list_instances(const std::vector<std::string>& entries,
                                           std::vector<std::string>* invalid = nullptr);

/// Returns the sockets in config::socket_folders() that accept connections, and those on which systemd starts a daemon
/// at the first connection (this call starts none); the first of equal names.
std::vector<std::string> running_sockets(std::vector<std::string>* invalid = nullptr);

/// Returns `socket` if given, else $PRISM_SOCKET, else the socket of instance `name`, else that of the only running
/// instance. Errors: none or several are running, or the name is unknown.
Result<std::string> find_socket(const std::string& socket, const std::string& name);

}  // namespace prism::client
