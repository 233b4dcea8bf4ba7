// SPDX-License-Identifier: MIT
// Where programs find each other on a host: the sockets of the instances and the status of the relay.
#pragma once

#include <string>
#include <vector>

namespace prism::config {

/// Directories of sockets in search order: /run/prismd (systemd and root), then the user's own, $XDG_RUNTIME_DIR/prismd
/// (/run/user/UID/prismd if the variable is not set).
std::vector<std::string> socket_folders();

/// Default socket of an instance: in the user's directory; in /run/prismd for root, for a systemd service
/// (LOGS_DIRECTORY is set), and if the user has no directory.
std::string default_socket(const std::string& instance);

/// Sockets (NAME.sock) in a directory, sorted. Names that do not follow TextRule::kName are not listed: they are added
/// to `invalid`, if given, as printable paths.
std::vector<std::string> sockets_in(const std::string& directory, std::vector<std::string>* invalid = nullptr);

/// Name of the instance of a socket: the file name without ".sock".
std::string instance_name(const std::string& socket);

/// Returns true if systemd listens at `socket` for an instance that is not running: a connection would start it, even
/// if an operator has stopped it. Reads the directories that prismd@.socket and prismd@.service keep next to the
/// socket.
bool would_start(const std::string& socket);

/// Where a relay writes its status by default: first that of root and systemd, then, if it exists, that of the user.
std::vector<std::string> relay_status_files();

}  // namespace prism::config
