// SPDX-License-Identifier: MIT
// Copies each type of file for repair(), one source file each.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tools/prismcal/verification/folder_contents.hpp"
#include "tools/prismcal/verification/repair.hpp"

namespace prism::verification {

/// Destination of the copies: an existing folder, and the statistics.
struct Copies {
  std::filesystem::path out;
  Repaired& repaired;

  void leave_out(const std::string& path, std::size_t line, const std::string& why) const {
    repaired.left_out.push_back({path, line, why});
  }
  std::string target(const std::string& path) const { return (out / std::filesystem::path(path).filename()).string(); }
};

Result<void> copy_bytes(const std::string& path, const Copies& copies);
/// Copies the segments of contents.log and writes their index.
Result<void> copy_log(const FolderContents& contents, const Copies& copies);
/// Copies the captures, and writes an index if there was one.
Result<void> copy_captures(const FolderContents& contents, const Copies& copies);

/// Writes a new index `name` with a new id, for these files and their numbers of rows (0: unknown), in this order.
Result<void> write_index(const std::string& name, const std::vector<std::pair<std::string, std::uint64_t>>& made,
                         const Copies& copies);

}  // namespace prism::verification
