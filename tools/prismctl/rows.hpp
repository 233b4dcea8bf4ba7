// SPDX-License-Identifier: MIT
// `prismctl rows`: prints rows of a log from a cursor on.
#pragma once

#include <cstdint>
#include <string>

namespace prism::prismctl {

struct RowsSettings {
  std::string after;        ///< a cursor, "earliest" or "latest"; empty: "earliest"
  std::string cursor_file;  ///< stores the cursor between calls; takes precedence over `after`
  std::string axis;
  std::uint64_t limit = 0;  ///< max. number of rows; 0: no limit
  bool follow = false, json = false;
};

/// Prints rows as CSV, or as one JSON object per line, to the end of the log; with `follow` for ever, also over
/// restarts of the daemon. Reports rows that were deleted before it read them on stderr. Returns the exit code.
int rows(const std::string& socket, const RowsSettings& settings);

}  // namespace prism::prismctl
