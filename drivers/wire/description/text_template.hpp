// SPDX-License-Identifier: MIT
// A text kind's "write" template: numbers of fields in their forms.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/wire/description/frame_kind.hpp"

namespace prism::wire {

/// What is wrong with a text kind's template; empty where it is good.
std::string template_fault(const FrameKind& kind);

/// A text kind's frame: its template with the raw numbers of the fields (by field index), and its terminator.
std::vector<std::uint8_t> print_frame(const FrameKind& kind, std::span<const double> raw);

}  // namespace prism::wire
