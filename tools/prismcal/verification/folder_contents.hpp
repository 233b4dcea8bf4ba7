// SPDX-License-Identifier: MIT
// The files of a folder, sorted by file type.
#pragma once

#include <string>
#include <vector>

namespace prism::verification {

struct FolderContents {
  std::string folder;
  std::string log;  ///< what LogFolder reads: the folder, or one file; empty: there is no log
  std::vector<std::string> captures, documents, others;  ///< paths, by name; documents: *.json
  bool one_file = false;                                 ///< it was named by a person: nothing is passed over
};

/// Of `path` and of every folder below it; links to folders are not followed there. Of a file: that file alone. What
/// cannot be listed is left out.
std::vector<FolderContents> contents_of(const std::string& path);

}  // namespace prism::verification
