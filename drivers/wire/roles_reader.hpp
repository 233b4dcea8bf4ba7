// SPDX-License-Identifier: MIT
// Reads what the fields of a description are for: gyro, counter, temperature, UHFO voltage, status, latency.
#pragma once

#include "drivers/wire/frame_description.hpp"
#include "drivers/wire/json_section.hpp"

namespace prism::wire {

/// After the kinds: gives each kind its roles and the description its rules.
void read_roles(const Section& section, const GyroChoice& choice, FrameDescription& description);

}  // namespace prism::wire
