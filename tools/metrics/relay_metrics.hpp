// SPDX-License-Identifier: MIT
// Metrics of prismrelay.
#pragma once

#include <nlohmann/json.hpp>

#include "tools/metrics/exposition.hpp"

namespace prism::metrics {

/// Adds the metrics of the relay from its status (the file that `prismrelay --status` reads).
void add_relay(Exposition& exposition, const nlohmann::json& status);

}  // namespace prism::metrics
