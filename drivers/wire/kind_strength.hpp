// SPDX-License-Identifier: MIT
// How surely a kind of frame is recognised, and how many bytes that takes.
#pragma once

#include "drivers/wire/frame_kind.hpp"

namespace prism::wire {

/// Sorts the sync, finds the checks of the header and the bytes they need.
void measure_header(FrameKind& kind);

/// How many bits say that this is a frame, and how many good ones in a row it takes to believe a weak kind: until 32
/// bits have spoken.
void weigh(FrameKind& kind);

}  // namespace prism::wire
