// SPDX-License-Identifier: MIT
// Bytes of a frame that its description does not explain.
#pragma once

#include <string>
#include <vector>

#include "drivers/wire/description/frame_description.hpp"

namespace prism::wire {

/// "message type data: bytes 5, 12 to 14 belong to no sync, field, check or body", one line per message type of a fixed
/// length and layout that has such bytes.
std::vector<std::string> unnamed_bytes(const FrameDescription& description);

}  // namespace prism::wire
