// SPDX-License-Identifier: MIT
// Any bytes as a configuration: rejected in one line, or accepted with names that are valid in paths.
#include <cstdint>
#include <string>
#include <string_view>

#include "config/config.hpp"
#include "tests/fuzz/require.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto config = prism::config::parse_config(text, "/fuzz/gyro.json");
  if (!config) {
    const std::string line = config.error().text();
    require(!line.empty() && line.size() < 1000);
    for (const char c : line) require(c != '\n' && c != '\0');
    return 0;
  }
  require(!config->name.empty() && config->name.size() < 256);
  for (const std::string& word : {config->name, config->gyro_serial}) {
    for (const char c : word) require(static_cast<unsigned char>(c) >= 0x20);
  }
  require(config->name.find('/') == std::string::npos);
  require(*prism::config::parse_config(text, "/fuzz/gyro.json") == *config);
  return 0;
}
