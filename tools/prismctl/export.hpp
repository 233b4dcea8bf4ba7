// SPDX-License-Identifier: MIT
// `prismctl export`: writes the rows of a time span into a directory, as log files that prismcal reads.
#pragma once

#include <string>

namespace prism::prismctl {

struct ExportSettings {
  std::string directory;  ///< new, or empty
  std::string from, to;   ///< UTC: 2026-11-23T09:11:00; empty: no limit
  std::string axis;       ///< empty: every axis
};

/// Fetches the log through the socket, so that any member of its group can copy it, and writes each segment under its
/// own name with its header. Rows are unchanged; only those from `from` to before `to` are written. Complete files
/// appear at once. Returns the exit code.
int export_log(const std::string& socket, const ExportSettings& settings);

}  // namespace prism::prismctl
