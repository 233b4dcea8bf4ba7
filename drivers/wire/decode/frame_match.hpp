// SPDX-License-Identifier: MIT
// Tests if a frame of a message type starts here: sync, length, body and checks, in this order.
#pragma once

#include <cstdint>
#include <span>

#include "drivers/wire/description/frame_view.hpp"
#include "drivers/wire/description/message_type.hpp"

namespace prism::wire {

enum class Match {
  kYes,
  kNeedMore,  ///< matches so far, but the frame continues after the available bytes
  kNoSync,
  kBadLength,  ///< invalid length field, or no terminator within the maximum length
  kBadBody,    ///< violates a body rule, or has broken items or columns
  kBadCheck,
  kRefused,  ///< intact, but a refuse rule applies
};

struct MatchResult {
  Match match = Match::kNoSync;
  std::uint32_t length = 0;  ///< bytes of the frame, for kYes (kNeedMore, kBadCheck: as far as known)
};

/// `bytes` starts at the possible start of the frame; `before` is the preceding byte, or -1 if unknown. After kYes the
/// view refers to the frame.
MatchResult match_frame(const MessageType& kind, std::span<const std::uint8_t> bytes, int before, FrameView& view);

}  // namespace prism::wire
