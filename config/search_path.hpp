// SPDX-License-Identifier: MIT
// Where frame descriptions and models are found by bare name.
#pragma once

#include <filesystem>
#include <string>

namespace prism {

/// `name` with a '/' or ending in ".json" is a path, relative to `base`. A bare name is NAME.json in `folder` ("frames",
/// "models") beside the configuration, of $PRISM_DATA, of /etc/prism, of the installed data, and of the source tree a
/// program was built in; the first that exists. Where none does, the path beside the configuration, so that the
/// refusal to read it names a place to put it.
std::string find_data_file(const std::string& name, const std::string& folder, const std::filesystem::path& base);

}  // namespace prism
