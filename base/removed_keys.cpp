// SPDX-License-Identifier: MIT
#include "base/removed_keys.hpp"

#include <vector>

namespace prism {
namespace {

constexpr std::string_view kServe = "it has no effect; let ser2net serve the line to several programs (lines.md)";

}  // namespace

std::span<const RemovedKey> removed_keys() {
  static const std::vector<RemovedKey> kKeys{
      // {file, path, stops, instead}
      {KeyFile::kPrismd, "line/serve", false, kServe},
      {KeyFile::kPrismd, "sensor_lines/*/serve", false, kServe},
      {KeyFile::kWeb, "foxglove", false, "it has no effect; read the gyro with the Python client (clients.md)"},
      {KeyFile::kWeb, "passwords", true, "let nginx or caddy ask for the passwords (page.md, \"Other hosts\")"},
      {KeyFile::kWeb, "tls", true, "let nginx or caddy have the certificate (page.md, \"Other hosts\")"},
      {KeyFile::kWeb, "plotjuggler", false,
       "it has no effect; run examples/plotjuggler.py of the Python client (clients.md)"},
  };
  return kKeys;
}

}  // namespace prism
