// SPDX-License-Identifier: MIT
// The relay and the gyros that it follows as Prometheus' text.
#pragma once

#include <string>

#include "tools/prismrelay/state.hpp"

namespace prism::prismrelay {

std::string metrics_text(const RelayState::View& view);

}  // namespace prism::prismrelay
