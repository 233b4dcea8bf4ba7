// SPDX-License-Identifier: MIT
// The files that a task reads: their SHA-256, and whose gyro they are, asked of the disk once and kept.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::campaign {

struct InputFile {
  std::string path, sha256;
  std::string serial, axis;  ///< "gyro_serial" and "axis" of a log's metadata; empty: it does not say
  std::uint64_t bytes = 0, lines = 0;
};

/// What was read of files, by path, size, time of change and inode. A file that changed within two seconds before it
/// was read is read again: a change in the same tick of the clock would not show.
class InputCache {
 public:
  /// Reads what an earlier run kept in `file`; one that is not there, or is damaged, is empty.
  explicit InputCache(std::string file);

  /// Errors: a file that cannot be read.
  Result<InputFile> describe(const std::string& path);
  /// Writes what is new, if anything is.
  Result<void> save();
  std::size_t files_read() const { return files_read_; }  ///< how many had to be read

 private:
  struct Stamp {
    std::uint64_t size = 0, inode = 0, device = 0;
    std::int64_t changed_ns = 0;
    bool operator==(const Stamp&) const = default;
  };
  struct Entry {
    Stamp stamp;
    InputFile file;
  };
  std::string file_;
  std::map<std::string, Entry> entries_;
  std::size_t files_read_ = 0;
};

/// The files that make one recording: the file itself, or of a folder its logs and their indexes, by name.
std::vector<std::string> files_of_recording(const std::string& path);

/// Every path that matches a shell pattern, by name; empty if no path matches.
std::vector<std::string> paths_of_pattern(const std::string& pattern);

}  // namespace prism::campaign
