// SPDX-License-Identifier: MIT
// A frame of a kind with everything that never changes in it: sync, length, item headers, presets.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/wire/frame_kind.hpp"

namespace prism::wire {

/// Binary kinds only. Checks are not filled in.
std::vector<std::uint8_t> blank_frame(const FrameKind& kind);

/// Puts the constant bits (sync, body rules) back over a frame whose fields have been written.
void apply_constants(const FrameKind& kind, std::span<std::uint8_t> frame);

/// What is wrong with a text kind's "write" template; empty where it is good.
std::string template_fault(const FrameKind& kind);

/// A text kind's frame: its "write" template with the raw numbers of the fields (by field index), and its terminator.
std::vector<std::uint8_t> print_frame(const FrameKind& kind, std::span<const double> raw);

}  // namespace prism::wire
