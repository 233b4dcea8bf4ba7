// SPDX-License-Identifier: MIT
// Does a frame of this kind stand here? Sync, length, body and checks, in that order.
#pragma once

#include <cstdint>
#include <span>

#include "drivers/wire/description/frame_kind.hpp"
#include "drivers/wire/description/frame_view.hpp"

namespace prism::wire {

enum class Match {
  kYes,
  kNeedMore,  ///< everything fits so far, but the frame goes on behind the bytes at hand
  kNoSync,
  kBadLength,  ///< length field out of bounds, or no terminator within the longest length
  kBadBody,    ///< a body or refuse rule, or broken items or columns
  kBadCheck,
};

struct MatchResult {
  Match match = Match::kNoSync;
  std::uint32_t length = 0;  ///< bytes of the frame, for kYes (kNeedMore: what is known of it)
};

/// `bytes` begins where the frame would begin; `before` is the byte in front of it, -1 where none is known. On kYes
/// the view looks at the frame.
MatchResult match_frame(const FrameKind& kind, std::span<const std::uint8_t> bytes, int before, FrameView& view);

}  // namespace prism::wire
