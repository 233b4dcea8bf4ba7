// SPDX-License-Identifier: MIT
// Settings of prismweb.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace prism::prismweb {

inline constexpr int kExitDone = 0, kExitFailed = 1, kExitUsage = 64, kExitBug = 70, kExitConfig = 78;

struct Settings {
  std::string address = "127.0.0.1";   ///< a loopback address; empty: no TCP
  std::uint16_t port = 8467;           ///< 0: any free port
  std::string unix_socket;             ///< path of the Unix socket to listen on; empty: none
  std::vector<std::string> hosts;      ///< more names of this server
  std::vector<std::string> instances;  ///< names or socket paths; empty: all of the host
  std::string page, dygraphs;          ///< directories of files
  std::string state;                   ///< directory of the stores; empty: none
  std::vector<std::string> warnings;   ///< one per key that has no effect any more
};

}  // namespace prism::prismweb
