// SPDX-License-Identifier: MIT
// Identifies one start of the service behind a socket.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

namespace prism::prismweb {

/// Changes with each start of the systemd service of `socket`. nullopt if systemd does not listen there or the service
/// is not running. See config::would_start() for the files.
using ServiceRunId = std::optional<std::pair<std::uint64_t, std::int64_t>>;
ServiceRunId service_run_id(const std::string& socket);

}  // namespace prism::prismweb
