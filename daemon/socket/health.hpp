// SPDX-License-Identifier: MIT
// One word for the state of an instance, and what is wrong.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "daemon/socket/sources.hpp"

namespace prism::socket {

/// {"state": "good", "caution" or "failed", "problems": one line each, the failures first}. Good only if data,
/// corrections, model, log, capture and disk are. Failed: something is lost or must not be used.
nlohmann::ordered_json health_json(const Sources& sources);

}  // namespace prism::socket
