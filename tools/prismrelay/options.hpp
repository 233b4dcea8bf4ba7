// SPDX-License-Identifier: MIT
// prismrelay's command line.
#pragma once

#include <optional>
#include <string>

namespace prism::prismrelay {

inline constexpr int kExitDone = 0, kExitFailed = 1, kExitUsage = 64, kExitConfig = 78;

struct Options {
  std::string config = "/etc/prism/relay.json";
  bool check = false, schema = false, init = false, status = false, json = false;
};

/// An exit code where there is nothing to run: help, version, or a wrong command line.
std::optional<int> parse_options(int argc, char** argv, Options& options);

}  // namespace prism::prismrelay
