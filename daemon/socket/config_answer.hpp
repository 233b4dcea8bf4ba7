// SPDX-License-Identifier: MIT
// JSON of the configuration in force.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "daemon/socket/sources.hpp"

namespace prism::socket {

/// All settings, with defaults and overrides.
nlohmann::ordered_json config_answer(const Sources& sources);

}  // namespace prism::socket
