// SPDX-License-Identifier: MIT
// prismweb's command line.
#pragma once

#include <optional>

#include "tools/prismweb/settings.hpp"

namespace prism::prismweb {

/// What the command line asks for beside serving.
struct Options {
  Settings settings;
  bool check = false;          ///< say whether the configuration is good, and end
  bool hash_password = false;  ///< read a password, write its line for the file of passwords, and end
};

/// Parses argv; prints help, version, usage errors and refused configurations itself. A value: the exit code to end
/// with at once.
std::optional<int> parse_options(int argc, char** argv, Options& options);

}  // namespace prism::prismweb
