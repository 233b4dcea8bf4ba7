// SPDX-License-Identifier: MIT
// What a description must not say although every key is legal: overlaps, places outside the frame, impossible rates.
#pragma once

#include "drivers/wire/frame_description.hpp"
#include "drivers/wire/json_section.hpp"

namespace prism::wire {

/// Adds the first contradiction to `problems`, and to the description's warnings what is legal but worth knowing.
void check_description(Problems& problems, FrameDescription& description);

}  // namespace prism::wire
