// SPDX-License-Identifier: MIT
// A frame with all constant parts of its message type: sync, length, item headers, defaults.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/wire/description/message_type.hpp"

namespace prism::wire {

/// Binary message types only. Does not fill in checks.
std::vector<std::uint8_t> blank_frame(const MessageType& kind);

/// Writes the constant bits (sync, body rules) again after the fields were written.
void apply_constants(const MessageType& kind, std::span<std::uint8_t> frame);

}  // namespace prism::wire
