// SPDX-License-Identifier: MIT
// Input files of a task: SHA-256, serial number and axis.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::campaign {

struct InputFile {
  std::string path, sha256;
  std::string serial, axis;  ///< "gyro_serial" and "axis" of a log's metadata; empty: unknown
};

/// Reads a file. Errors: it cannot be read.
Result<InputFile> read_input(const std::string& path);

/// Returns the files of one recording: the file itself, or the logs and their indexes of a folder, sorted by name.
std::vector<std::string> files_of_recording(const std::string& path);

/// Returns the paths that match a shell pattern (glob with braces), sorted by name.
std::vector<std::string> paths_of_pattern(const std::string& pattern);

}  // namespace prism::campaign
