// SPDX-License-Identifier: MIT
#include "tools/prismweb/options.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "config/search_path.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismweb/web_config.hpp"

namespace prism::prismweb {
namespace {

constexpr const char* kDygraphs = "/usr/share/javascript/dygraphs";

// The directory from systemd, else in the user's cache.
std::string default_state() {
  if (const char* made = std::getenv("STATE_DIRECTORY"); made != nullptr && *made != '\0') return made;
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache != '\0')
    return std::string(cache) + "/prismweb";
  const char* const home = std::getenv("HOME");
  return home != nullptr && *home != '\0' ? std::string(home) + "/.cache/prismweb" : "";
}

}  // namespace

std::optional<int> parse_options(int argc, char** argv, Options& options) {
  CLI::App app("prismweb: serves a web page and an API for the gyros of this host");
  tools::use_readable_help(app);
  std::string config, listen, socket, page, state;
  std::vector<std::string> instances;
  app.set_version_flag("--version", std::string("prismweb ") + kVersion);
  app.add_option("--config", config, "configuration file, see prismweb(8)")->type_name("FILE");
  app.add_flag("--check", options.check, "check the configuration, then exit (0 valid, 78 invalid)");
  app.add_option("--listen", listen, "loopback address to listen on (default: 127.0.0.1:8467); port 0: any free port")
      ->type_name("ADDRESS:PORT");
  app.add_option("--socket", socket, "listen on a Unix socket instead, for a proxy")->type_name("PATH");
  app.add_option("--instance", instances,
                 "instance name or socket path; may be repeated (default: all instances of the host)")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->type_name("NAME|PATH");
  app.add_option("--page", page, "directory of the page's files (default: the installed ones)")->type_name("FOLDER");
  app.add_option("--state", state, "directory for minutes and hours of long views (default: ~/.cache/prismweb)")
      ->type_name("FOLDER");
  tools::add_examples(app, {"prismweb", "prismweb --instance gyro1 --state ~/.cache/prismweb",
                            "prismweb --config /etc/prism/web.json --check"});
  const auto exit_with = [](int code, const std::string& what) {
    fmt::print(stderr, "prismweb: {}\n", what);
    return code;
  };
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    return exit_with(kExitUsage, std::string(error.what()) + "; see prismweb --help");
  }
  Settings& settings = options.settings;
  settings.page = config::data_places("page", "").back().string();
  settings.dygraphs = kDygraphs;
  settings.state = default_state();
  if (!config.empty()) {
    const Result<void> read = load_web_config(config, settings);
    if (!read) return exit_with(kExitConfig, read.error().text());
  }
  if (!listen.empty()) {
    const Result<void> parsed = parse_listen(listen, settings);
    if (!parsed) return exit_with(kExitUsage, "--listen: " + parsed.error().what);
  }
  if (!socket.empty()) {
    settings.address.clear();
    settings.unix_socket = socket;
  }
  if (!instances.empty()) settings.instances = instances;
  if (!page.empty()) settings.page = page;
  if (!state.empty()) settings.state = state;
  return std::nullopt;
}

}  // namespace prism::prismweb
