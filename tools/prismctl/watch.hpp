// SPDX-License-Identifier: MIT
// `prismctl watch`: a live screen on a terminal, lines or JSON elsewhere.
#pragma once

#include <string>

#include "tools/client/connection.hpp"

namespace prism::prismctl {

struct WatchSettings {
  bool json = false;
  bool samples = false;     ///< lines and JSON: every sample instead of one row a second
  std::uint64_t count = 0;  ///< end after so many rows; 0: never
  int every = 1;            ///< of samples
  std::string axis;         ///< of several: the one that is meant; empty: all
  bool several = false;     ///< rows of several axes come, each says which
};

/// Runs until Ctrl-C (exit code 0), the count, or the daemon goes away (it waits for it to come back on a terminal;
/// else 1).
int watch(const std::string& socket, const WatchSettings& settings);

}  // namespace prism::prismctl
