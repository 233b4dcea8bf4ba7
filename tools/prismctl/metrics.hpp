// SPDX-License-Identifier: MIT
// `prismctl metrics`: state of the instances of this host in Prometheus' text format.
#pragma once

#include <string>

namespace prism::prismctl {

/// Writes the metrics of the given socket ($PRISM_SOCKET, too) or instance, else of all sockets in the socket
/// directories. An instance that does not respond, or that a connection would start, has prism_up 0. `file`: empty for
/// standard output. Returns the exit code.
int metrics(const std::string& socket, const std::string& name, const std::string& file);

}  // namespace prism::prismctl
