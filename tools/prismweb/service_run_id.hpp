// SPDX-License-Identifier: MIT
// Which run of a service stands behind a socket.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

namespace prism::prismweb {

/// Changes with each start of the service that systemd runs behind `socket`; nothing where systemd does not listen
/// there (config::would_start has the folders).
using ServiceRunId = std::optional<std::pair<std::uint64_t, std::int64_t>>;
ServiceRunId service_run_id(const std::string& socket);

}  // namespace prism::prismweb
