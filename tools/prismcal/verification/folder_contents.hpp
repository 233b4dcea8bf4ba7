// SPDX-License-Identifier: MIT
// The files of a folder, sorted by file type.
#pragma once

#include <string>
#include <vector>

namespace prism::verification {

struct FolderContents {
  std::string folder;
  std::string log;                            ///< path for LogFolder: the folder, or one file; empty: no log
  std::vector<std::string> captures, others;  ///< sorted paths
  bool one_file = false;                      ///< `folder` has only this file, named on the command line
};

/// Lists `path` and all folders below it without following links to folders, or the single file `path`. Omits folders
/// that cannot be read.
std::vector<FolderContents> contents_of(const std::string& path);

}  // namespace prism::verification
