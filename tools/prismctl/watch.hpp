// SPDX-License-Identifier: MIT
// `prismctl watch`: live screen on a terminal, else lines or JSON.
#pragma once

#include <string>

#include "tools/client/connection.hpp"

namespace prism::prismctl {

struct WatchSettings {
  bool json = false;
  bool samples = false;     ///< lines and JSON: samples instead of one row a second
  std::uint64_t count = 0;  ///< stop after this number of rows; 0: never
  int every = 1;            ///< every n-th sample
  std::string axis;         ///< of a device with several axes; empty: all
  bool several = false;     ///< rows of several axes, each with its axis
};

/// Runs until Ctrl-C or the count (exit code 0), or until the daemon disconnects (exit code 1; on a terminal it
/// reconnects).
int watch(const std::string& socket, const WatchSettings& settings);

}  // namespace prism::prismctl
