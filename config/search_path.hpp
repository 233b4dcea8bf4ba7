// SPDX-License-Identifier: MIT
// Where frame descriptions and models are found by bare name.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::config {

/// `name` with a '/' or ending in ".json" is a path, relative to `base`. A bare name is NAME.json in `folder`
/// ("frames", "models") beside the configuration, of $PRISM_DATA, of /etc/prism, and of the project's own data; the
/// first that exists. Where none does, the path beside the configuration, so that the refusal to read it names a place
/// to put it. The project's own data are share/prism beside the program's folder or one of the folders above it: of the
/// prefix that it is installed in, wherever that was moved to, or of the build tree.
std::string find_data_file(const std::string& name, const std::string& folder, const std::filesystem::path& base);

/// Where a bare name is looked for: `folder` beside the configuration, and in each of the data folders, in that order.
std::vector<std::filesystem::path> data_places(const std::string& folder, const std::filesystem::path& base);

/// Every NAME.json that find_data_file would find by its bare name, in the order of the names.
std::vector<std::string> data_files(const std::string& folder, const std::filesystem::path& base);

/// The text of the file that find_data_file named. Where it is not there, the refusal has a near name and the places
/// that were searched.
Result<std::string> read_data_file(const std::string& path, const std::string& folder);

}  // namespace prism::config
