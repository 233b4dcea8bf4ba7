// SPDX-License-Identifier: MIT
// Where frame descriptions and models are found by bare name.
#pragma once

#include <filesystem>
#include <string>

namespace prism::config {

/// `name` with a '/' or ending in ".json" is a path, relative to `base`. A bare name is NAME.json in `folder`
/// ("frames", "models") beside the configuration, of $PRISM_DATA, of /etc/prism, and of the project's own data; the
/// first that exists. Where none does, the path beside the configuration, so that the refusal to read it names a place
/// to put it. The project's own data are share/prism beside the program's folder or one of the folders above it: of the
/// prefix that it is installed in, wherever that was moved to, or of the build tree.
std::string find_data_file(const std::string& name, const std::string& folder, const std::filesystem::path& base);

}  // namespace prism::config
