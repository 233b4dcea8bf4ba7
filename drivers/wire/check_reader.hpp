// SPDX-License-Identifier: MIT
// Reads one check of a kind from a description's JSON.
#pragma once

#include "drivers/wire/check.hpp"
#include "drivers/wire/json_section.hpp"

namespace prism::wire {

CheckRule read_check(const Section& section, bool big_endian);

}  // namespace prism::wire
