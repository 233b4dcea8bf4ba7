// SPDX-License-Identifier: MIT
// Where the sockets of instances stand: the one place that prismd makes them in and prismctl looks for them in.
#pragma once

#include <string>
#include <vector>

namespace prism::config {

/// Folders of sockets, in the order in which they are looked through: /run/prismd, which systemd and root use, and the
/// user's own, $XDG_RUNTIME_DIR/prismd (/run/user/UID/prismd where that variable is not set).
std::vector<std::string> socket_folders();

/// The socket of an instance whose configuration names none: in the user's folder, but in /run/prismd for root, for a
/// service of systemd (which sets LOGS_DIRECTORY), and where the user has no folder.
std::string default_socket(const std::string& instance);

/// Sockets (NAME.sock) in a directory, sorted. Names that do not follow TextRule::kName are not listed: they are added
/// to `invalid`, if given, as printable paths.
std::vector<std::string> sockets_in(const std::string& directory, std::vector<std::string>* invalid = nullptr);

/// Name of the instance of a socket: its file name without ".sock".
std::string instance_name(const std::string& socket);

/// Whether systemd listens at `socket` for an instance that does not run now: whoever connects would start it, also
/// where somebody stopped it. From the folders that prismd@.socket and prismd@.service keep beside the socket.
bool would_start(const std::string& socket);

}  // namespace prism::config
