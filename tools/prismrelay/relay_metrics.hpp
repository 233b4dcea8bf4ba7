// SPDX-License-Identifier: MIT
// Metrics of the relay and its gyros in Prometheus text format.
#pragma once

#include <string>

#include "tools/prismrelay/state.hpp"

namespace prism::prismrelay {

std::string metrics_text(const RelayState::View& view);

}  // namespace prism::prismrelay
