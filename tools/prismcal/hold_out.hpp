// SPDX-License-Identifier: MIT
// Splits the blocks of a recording into training and test blocks.
#pragma once

#include <cstdint>
#include <string>

#include "tools/prismcal/block_table.hpp"

namespace prism::recordings {

/// Which part is held out for the test: none, the end of each recording, or every second segment.
struct HoldOut {
  double share = 0;            ///< share of the recording's time, at its end; 0: not used
  std::int64_t segment_s = 0;  ///< length of each segment, s; 0: not used

  bool wanted() const { return share > 0 || segment_s > 0; }
  std::string text() const;  ///< "the last 50 %", "every second 600 s"
};

/// Parses "0.5" (0.05 to 0.95) or "blocks:600" (seconds).
Result<HoldOut> parse_hold_out(const std::string& text);

struct Split {
  BlockTable training, held_out;
  std::size_t between = 0;  ///< number of unused blocks between them
};

/// Training and held-out blocks are at least a window apart: neighbouring blocks share slow noise. BlockTable::gaps and
/// missing_s of the parts are 0. Errors: segments too short for that, fewer than two training or held-out blocks.
Result<Split> split_blocks(const BlockTable& table, const HoldOut& hold_out);

}  // namespace prism::recordings
