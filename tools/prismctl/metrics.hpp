// SPDX-License-Identifier: MIT
// `prismctl metrics`: the instances of this host as Prometheus' text.
#pragma once

#include <string>

namespace prism::prismctl {

/// Of the socket or the instance named ($PRISM_SOCKET, too), else of all in the folders of sockets. An instance that
/// does not answer, or that a question would start, is prism_up 0; the others go on. `file`: empty for standard output.
/// The exit code.
int metrics(const std::string& socket, const std::string& name, const std::string& file);

}  // namespace prism::prismctl
