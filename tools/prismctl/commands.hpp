// SPDX-License-Identifier: MIT
// The commands of prismctl that are more than one request and its text. Each returns the exit code.
#pragma once

#include <cstdint>
#include <string>

namespace prism::prismctl {

struct AxisSettings {
  std::string axis;  ///< of a device with several axes; empty: the only one, or all
  bool json = false;
};

struct RowsSettings : AxisSettings {
  std::string after;        ///< a cursor, "earliest" or "latest"; empty: "earliest"
  std::string cursor_file;  ///< stores the cursor between calls; takes precedence over `after`
  std::uint64_t limit = 0;  ///< max. number of rows; 0: no limit
  bool follow = false;
};

/// Prints rows as CSV, or as one JSON object per line, to the end of the log; with `follow` for ever, also over
/// restarts of the daemon. Reports rows that were deleted before it read them on stderr.
int rows(const std::string& socket, const RowsSettings& settings);

struct ExportSettings : AxisSettings {
  std::string directory;  ///< new, or empty
  std::string from, to;   ///< UTC: 2026-11-23T09:11:00; empty: no limit
};

/// Fetches the log through the socket, so that any member of its group can copy it, and writes each segment under its
/// own name with its header. Rows are unchanged; only those from `from` to before `to` are written. Complete files
/// appear at once.
int export_log(const std::string& socket, const ExportSettings& settings);

struct WatchSettings : AxisSettings {
  bool samples = false;     ///< lines and JSON: samples instead of one row a second
  std::uint64_t count = 0;  ///< stop after this number of rows; 0: never
  int every = 1;            ///< every n-th sample
};

/// A live screen on a terminal, which reconnects; else lines or JSON until prismd disconnects (exit code 1). Runs until
/// Ctrl-C, `q` or the count.
int watch(const std::string& socket, const WatchSettings& settings);

}  // namespace prism::prismctl
