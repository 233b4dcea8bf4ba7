// SPDX-License-Identifier: MIT
#include "tools/prismrelay/options.hpp"

#include <fmt/format.h>

#include "base/escape.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"

namespace prism::prismrelay {

std::optional<int> parse_options(int argc, char** argv, Options& options) {
  CLI::App app("prismrelay: sends the rows of all gyros of this host to PostgreSQL, MQTT and Prometheus");
  tools::use_readable_help(app);
  app.set_version_flag("--version", std::string("prismrelay ") + kVersion);
  app.add_option("config", options.config, "configuration file")->capture_default_str();
  auto* check = app.add_flag("--check", options.check, "validate the configuration and exit");
  auto* schema = app.add_flag("--schema", options.schema, "print the SQL of --init and exit");
  auto* init = app.add_flag("--init", options.init,
                            "create the tables in the configured database, or those that are missing, and exit");
  auto* status = app.add_flag("--status", options.status, "print the running relay's status; exit 1 if none");
  auto* as_json = app.add_flag("--json", options.json, "with --status: print JSON");
  as_json->needs(status);
  for (auto* one : {check, schema, init, status}) {
    for (auto* other : {check, schema, init, status}) {
      if (one != other) one->excludes(other);
    }
  }
  tools::add_examples(app, {"prismrelay --init /etc/prism/relay.json", "prismrelay --status"});
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    fmt::print(stderr, "prismrelay: {} (see prismrelay --help)\n", printable(error.what()));
    return kExitUsage;
  }
  return std::nullopt;
}

}  // namespace prism::prismrelay
