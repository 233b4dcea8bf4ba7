// SPDX-License-Identifier: MIT
#include "tools/prismrelay/options.hpp"

#include <fmt/format.h>

#include "base/escape.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"

namespace prism::prismrelay {

std::optional<int> parse_options(int argc, char** argv, Options& options) {
  CLI::App app("prismrelay: carries the rows of every prismd of this host to PostgreSQL, MQTT and Prometheus");
  tools::use_readable_help(app);
  app.set_version_flag("--version", std::string("prismrelay ") + kVersion);
  app.add_option("config", options.config, "the configuration")->capture_default_str();
  auto* check = app.add_flag("--check", options.check, "read the configuration, say whether it is good, and end");
  auto* schema = app.add_flag("--schema", options.schema, "print the ledger's tables as SQL, and end");
  auto* init = app.add_flag("--init", options.init, "make the tables in the configuration's database, and end");
  auto* status = app.add_flag("--status", options.status, "what the relay that runs says of itself; 1 where none runs");
  auto* as_json = app.add_flag("--json", options.json, "with --status: as JSON, for programs");
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
