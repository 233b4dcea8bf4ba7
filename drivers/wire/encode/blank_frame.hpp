// SPDX-License-Identifier: MIT
// A frame of a kind with everything that never changes in it: sync, length, item headers, presets.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/wire/description/frame_kind.hpp"

namespace prism::wire {

/// Binary kinds only. Checks are not filled in.
std::vector<std::uint8_t> blank_frame(const FrameKind& kind);

/// Puts the constant bits (sync, body rules) back over a frame whose fields have been written.
void apply_constants(const FrameKind& kind, std::span<std::uint8_t> frame);

}  // namespace prism::wire
