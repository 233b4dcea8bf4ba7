// SPDX-License-Identifier: MIT
// Command line of prismweb.
#pragma once

#include <optional>

#include "tools/prismweb/settings.hpp"

namespace prism::prismweb {

struct Options {
  Settings settings;
  bool check = false;  ///< check the configuration and exit
};

/// Parses argv; prints help, version, and errors of usage and configuration. Returns an exit code if the program must
/// exit now.
std::optional<int> parse_options(int argc, char** argv, Options& options);

}  // namespace prism::prismweb
