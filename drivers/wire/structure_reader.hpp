// SPDX-License-Identifier: MIT
// Reads how a kind of frame is built: sync, length, items, blocks, text columns.
#pragma once

#include "drivers/wire/frame_kind.hpp"
#include "drivers/wire/json_section.hpp"

namespace prism::wire {

/// No frame of any kind is longer.
inline constexpr std::int64_t kMaxFrameBytes = 8192;

void read_sync(const Section& section, FrameKind& kind);
/// The key "length" of a kind's section.
void read_length(const Section& kind_section, bool big_endian, FrameKind& kind);
void read_items(const Section& section, bool big_endian, FrameKind& kind);
void read_text(const Section& section, FrameKind& kind);
/// All but the mask field, which is not read yet.
void read_blocks(const Section& section, FrameKind& kind);

}  // namespace prism::wire
