// SPDX-License-Identifier: MIT
#include "tools/prismweb/program.hpp"

#include <fmt/format.h>

#include <iostream>
#include <string>
#include <utility>

#include "base/time_scale.hpp"
#include "tools/prismweb/options.hpp"
#include "tools/prismweb/passwords.hpp"
#include "tools/prismweb/service.hpp"

namespace prism::prismweb {
namespace {

int fail(int code, const std::string& what) {
  fmt::print(stderr, "prismweb: {}\n", what);
  return code;
}

int print_hash() {
  std::string password;
  std::getline(std::cin, password);
  const auto hash = hash_password(password);
  if (!hash) return fail(kExitUsage, hash.error().text());
  fmt::print("{}\n", *hash);
  return kExitDone;
}

}  // namespace

int run(int argc, char** argv) {
  Options options;
  if (const auto code = parse_options(argc, argv, options)) return *code;
  if (const auto scale = check_time_scale(); !scale) return fail(kExitConfig, scale.error().text());
  for (const std::string& warning : options.settings.warnings) fmt::print(stderr, "prismweb: warning: {}\n", warning);
  if (options.hash_password) return print_hash();
  Result<SecretFiles> files = load_secret_files(options.settings);
  if (!files) return fail(kExitConfig, files.error().text());
  if (options.check) {
    fmt::print("prismweb: good: {}\n",
               options.settings.unix_socket.empty() ? options.settings.address : options.settings.unix_socket);
    return kExitDone;
  }
  Service service(options.settings);
  return service.run(std::move(*files));
}

}  // namespace prism::prismweb
