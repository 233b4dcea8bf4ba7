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

// systemd's, else the user's.
std::string usual_state() {
  if (const char* made = std::getenv("STATE_DIRECTORY"); made != nullptr && *made != '\0') return made;
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache != '\0')
    return std::string(cache) + "/prismweb";
  const char* const home = std::getenv("HOME");
  return home != nullptr && *home != '\0' ? std::string(home) + "/.cache/prismweb" : "";
}

}  // namespace

std::optional<int> parse_options(int argc, char** argv, Options& options) {
  CLI::App app("prismweb: serves a page over the gyros of this host, and what they tell, to browsers and programs");
  tools::use_readable_help(app);
  std::string config, listen, socket, page, state;
  std::vector<std::string> instances;
  app.set_version_flag("--version", std::string("prismweb ") + kVersion);
  app.add_option("--config", config, "configuration file, see prismweb(8)")->type_name("FILE");
  app.add_flag("--check", options.check, "say whether the configuration is good, then exit (0 good, 78 bad)");
  app.add_option("--listen", listen, "where to listen (default: 127.0.0.1:8467); port 0: a free one")
      ->type_name("ADDRESS:PORT");
  app.add_option("--socket", socket, "listen on a unix socket instead, for a proxy")->type_name("PATH");
  app.add_option("--instance", instances,
                 "name of an instance, or path of its socket; again for the next one (default: all of the host)")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->type_name("NAME|PATH");
  app.add_option("--page", page, "folder of the page's files instead of the installed ones")->type_name("FOLDER");
  app.add_option("--state", state, "folder for minutes and hours of long views (default: ~/.cache/prismweb)")
      ->type_name("FOLDER");
  app.add_flag("--hash-password", options.hash_password,
               "read a password from standard input and print what the file of passwords has of it, then exit");
  tools::add_examples(app, {"prismweb", "prismweb --instance gyro1 --state ~/.cache/prismweb",
                            "prismweb --config /etc/prism/web.json --check"});
  const auto refused = [](int code, const std::string& what) {
    fmt::print(stderr, "prismweb: {}\n", what);
    return code;
  };
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    return refused(kExitUsage, std::string(error.what()) + "; see prismweb --help");
  }
  Settings& settings = options.settings;
  settings.page = config::data_places("page", "").back().string();
  settings.dygraphs = kDygraphs;
  settings.state = usual_state();
  if (!config.empty()) {
    const Result<void> read = load_web_config(config, settings);
    if (!read) return refused(kExitConfig, read.error().text());
  }
  if (!listen.empty() && !parse_listen(listen, settings))
    return refused(kExitUsage, fmt::format("--listen: found \"{}\", expected ADDRESS:PORT", listen));
  if (!socket.empty()) {
    settings.address.clear();
    settings.unix_socket = socket;
  }
  if (!instances.empty()) settings.instances = instances;
  if (!page.empty()) settings.page = page;
  if (!state.empty()) settings.state = state;
  if (const Result<void> safe = check_settings(settings); !safe) return refused(kExitConfig, safe.error().text());
  return std::nullopt;
}

}  // namespace prism::prismweb
