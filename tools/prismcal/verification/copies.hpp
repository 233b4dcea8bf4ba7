// SPDX-License-Identifier: MIT
// How repair() copies each kind of file, one source file each.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tools/prismcal/verification/folder_contents.hpp"
#include "tools/prismcal/verification/repair.hpp"

namespace prism::verification {

/// What copies go into: a folder that is there, and the account of them.
struct Copies {
  std::filesystem::path out;
  Repaired& repaired;

  void leave_out(const std::string& path, std::size_t line, const std::string& why) const {
    repaired.left_out.push_back({path, line, why});
  }
  std::string target(const std::string& path) const { return (out / std::filesystem::path(path).filename()).string(); }
};

Result<void> copy_bytes(const std::string& path, const Copies& copies);
/// The segments of contents.log, and an index of them.
Result<void> copy_log(const FolderContents& contents, const Copies& copies);
/// The captures, and an index where there was one.
Result<void> copy_captures(const FolderContents& contents, const Copies& copies);

/// A new index with an id of its own, called `name`, of these files and their rows (0: not known), in this order.
Result<void> write_index(const std::string& name, const std::vector<std::pair<std::string, std::uint64_t>>& made,
                         const Copies& copies);

}  // namespace prism::verification
