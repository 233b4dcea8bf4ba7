// SPDX-License-Identifier: MIT
// prismctl rows: a log's rows from any place of it, on and on.
#pragma once

#include <cstdint>
#include <string>

namespace prism::prismctl {

struct RowsSettings {
  std::string after;        ///< a cursor, "earliest" or "latest"; empty: where `follower` is, else the earliest
  std::string follower;     ///< the name that prismd remembers the place by
  std::string cursor_file;  ///< where the cursor is kept between two calls; it goes before `after`
  std::string axis;
  std::uint64_t limit = 0;  ///< rows in all; 0: no limit
  bool follow = false, json = false;
};

/// Prints rows as CSV, or as JSON objects a line, until there are no more; with `follow` for ever, over restarts of the
/// daemon. What was deleted before it could be read is told on stderr. Returns the exit code.
int rows(const std::string& socket, const RowsSettings& settings);

}  // namespace prism::prismctl
