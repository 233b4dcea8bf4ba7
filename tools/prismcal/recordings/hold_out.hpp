// SPDX-License-Identifier: MIT
// One recording for training and test: which of its blocks train a model and which judge it.
#pragma once

#include <cstdint>
#include <string>

#include "tools/prismcal/recordings/block_table.hpp"

namespace prism::recordings {

/// None, the end of each recording, or every second stretch of it.
struct HoldOut {
  double share = 0;            ///< of the recording's time, at its end; 0: not so
  std::int64_t stretch_s = 0;  ///< seconds of each stretch; 0: not so

  bool wanted() const { return share > 0 || stretch_s > 0; }
  std::string text() const;  ///< "the last 50 %", "every second 600 s"
};

/// "0.5" (0.05 to 0.95) or "blocks:600" (seconds). Refused: anything else.
Result<HoldOut> parse_hold_out(const std::string& text);

struct Split {
  BlockTable training, held;
  std::size_t between = 0;  ///< blocks of neither
};

/// What a held block is made of begins a window, or the longest lag, behind what a training block is made of, and the
/// other way round: neighbours share the slow part of their noise, and a lag remembers what was before it. The parts
/// count no holes. Refused: stretches too short for that, fewer than two blocks on either side.
Result<Split> split_blocks(const BlockTable& table, const HoldOut& hold_out);

}  // namespace prism::recordings
