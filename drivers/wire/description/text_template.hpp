// SPDX-License-Identifier: MIT
// The "write" template of a text message type: field numbers with their formats.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/wire/description/message_type.hpp"

namespace prism::wire {

/// The error in a template; empty if it is valid.
std::string template_fault(const MessageType& kind);

/// A text frame: the template with the fields' raw numbers (by field index), and its terminator.
std::vector<std::uint8_t> print_frame(const MessageType& kind, std::span<const double> raw);

}  // namespace prism::wire
