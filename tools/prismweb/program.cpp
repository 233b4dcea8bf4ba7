// SPDX-License-Identifier: MIT
#include "tools/prismweb/program.hpp"

#include <fmt/format.h>

#include <string>

#include "base/time_scale.hpp"
#include "tools/prismweb/options.hpp"
#include "tools/prismweb/service.hpp"

namespace prism::prismweb {

int run(int argc, char** argv) {
  Options options;
  if (const auto code = parse_options(argc, argv, options)) return *code;
  if (const auto scale = check_time_scale(); !scale) {
    fmt::print(stderr, "prismweb: {}\n", scale.error().text());
    return kExitConfig;
  }
  const Settings& settings = options.settings;
  for (const std::string& warning : settings.warnings) fmt::print(stderr, "prismweb: warning: {}\n", warning);
  if (options.check) {
    fmt::print("prismweb: good: {}\n", settings.unix_socket.empty() ? settings.address : settings.unix_socket);
    return kExitDone;
  }
  Service service(settings);
  return service.run();
}

}  // namespace prism::prismweb
