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

/// Returns an exit code after help, version or a usage error, else nullopt.
std::optional<int> parse_options(int argc, char** argv, Options& options);

}  // namespace prism::prismrelay
