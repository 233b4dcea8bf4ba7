// SPDX-License-Identifier: MIT
// Input files of a task: SHA-256, serial number and axis, cached on disk.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::campaign {

struct InputFile {
  std::string path, sha256;
  std::string serial, axis;  ///< "gyro_serial" and "axis" of a log's metadata; empty: unknown
  std::uint64_t bytes = 0, lines = 0;
};

/// Caches InputFile by path, size, mtime, inode and device. Files modified less than two seconds before the read are
/// not cached, since another change within the resolution of mtime would be invisible.
class InputCache {
 public:
  /// Loads the cache file of an earlier run; a missing or damaged one gives an empty cache.
  explicit InputCache(std::string file);

  /// Returns the cached entry, or reads the file. Errors: the file cannot be read.
  Result<InputFile> describe(const std::string& path);
  /// Writes the cache file if describe() read a file.
  Result<void> save();
  std::size_t files_read() const { return files_read_; }  ///< files that were not in the cache

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

/// Returns the files of one recording: the file itself, or the logs and their indexes of a folder, sorted by name.
std::vector<std::string> files_of_recording(const std::string& path);

/// Returns the paths that match a shell pattern (glob with braces), sorted by name.
std::vector<std::string> paths_of_pattern(const std::string& pattern);

}  // namespace prism::campaign
