// SPDX-License-Identifier: MIT
// Searches the usual variants of a check that never fits: range, byte order, and parameters of a CRC.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "drivers/wire/description/frame_description.hpp"

namespace prism::wire {

/// One line about the places in `bytes` at which sync, length and body of a message type fit, but a check does not:
/// "2000 candidates of data: the check is 4D 22, computed 91 C3 over bytes 0 to 17; with "from": 2 it fits". Empty if
/// there are fewer than ten, or a check fits. Uses at most 64 candidates.
std::string explain_checks(const FrameDescription& description, std::span<const std::uint8_t> bytes);

/// The same for one complete frame: "; sync and length fit, the check does not: …". Variants are tried only for checks
/// of 16 bits or more, because shorter ones fit by chance. Empty if another rule fails, or the checks fit.
std::string explain_check(const MessageType& kind, std::span<const std::uint8_t> frame);

}  // namespace prism::wire
