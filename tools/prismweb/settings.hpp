// SPDX-License-Identifier: MIT
// Settings of prismweb: command line and configuration.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/json_document.hpp"
#include "base/result.hpp"

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

/// Parses argv; prints help, version, and errors of usage and configuration. Returns an exit code if the program must
/// exit now.
std::optional<int> parse_options(int argc, char** argv, Settings& settings);

/// Parses "127.0.0.1:8467" or "[::1]:8467". Errors: other texts and addresses that are not loopback, with an empty
/// place; `settings` is then unchanged.
Result<void> parse_listen(std::string_view text, Settings& settings);

/// Sets the settings that the JSON `text` contains (comments allowed). Relative paths start at the directory of `path`.
/// Errors name the file and the key; unknown keys are errors.
Result<void> parse_web_config(std::string_view text, const std::string& path, Settings& settings);

/// JSON Schema of the configuration.
Json web_config_schema();

}  // namespace prism::prismweb
