// SPDX-License-Identifier: MIT
// Finds frame descriptions and models by bare name.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::config {

/// `name` with a '/' or ending in ".json" is a path, relative to `base`. A bare name is NAME.json in `folder`
/// ("frames", "models") next to the configuration, in $PRISM_DATA, in /etc/prism, or in the project's own data; the
/// first that exists is returned. If none exists, returns the path next to the configuration, so that the error shows
/// where to put the file. The project's own data are in share/prism next to the program's directory or a directory
/// above it: in the installation prefix, even if it was moved, or in the build tree.
std::string find_data_file(const std::string& name, const std::string& folder, const std::filesystem::path& base);

/// Directories searched for a bare name: `folder` next to the configuration, then in each data directory.
std::vector<std::filesystem::path> data_places(const std::string& folder, const std::filesystem::path& base);

/// All NAME.json that find_data_file finds by bare name, sorted by name.
std::vector<std::string> data_files(const std::string& folder, const std::filesystem::path& base);

/// Reads the file that find_data_file returned for the name at `place`, such as "gyro1.json:/frames" or "--frames". If
/// it does not exist, the error is of `place`, with the closest existing name, or all of them, and the searched
/// directories.
Result<std::string> read_data_file(const std::string& path, const std::string& folder, const std::string& place);

}  // namespace prism::config
