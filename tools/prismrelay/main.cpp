// SPDX-License-Identifier: MIT
// prismrelay: sends the rows of this host's prismds to PostgreSQL, MQTT and Prometheus.
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_member.hpp"
#include "base/time_scale.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismrelay/database.hpp"
#include "tools/prismrelay/relay.hpp"
#include "tools/prismrelay/report.hpp"

namespace prism::prismrelay {
namespace {

constexpr int kExitDone = 0, kExitFailed = 1, kExitUsage = 64, kExitConfig = 78;

struct Options {
  std::string config = "/etc/prism/relay.json";
  bool check = false, schema = false, init = false, status = false, json = false;
};

/// Returns an exit code after help, version or a usage error, else nullopt.
std::optional<int> parse_options(int argc, char** argv, Options& options) {
  CLI::App app("prismrelay: sends the rows of all gyros of this host to PostgreSQL, MQTT and Prometheus");
  tools::use_readable_help(app);
  app.set_version_flag("--version", std::string("prismrelay ") + kVersion);
  app.add_option("config", options.config, "configuration file")->capture_default_str();
  auto* check = app.add_flag("--check", options.check, "validate the configuration and exit");
  auto* schema = app.add_flag("--schema", options.schema, "print the SQL of --init and exit");
  auto* init = app.add_flag("--init", options.init, "create or update the tables in the configured database and exit");
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

int fail(const Error& error, int code = kExitFailed) {
  fmt::print(stderr, "prismrelay: {}\n", error.text());
  return code;
}

int show_status(const Settings& settings, bool as_json) {
  const auto text = read_text_file(settings.status_file);
  if (!text) return fail({settings.status_file, "cannot read the status; is prismrelay running?"});
  const auto status = nlohmann::json::parse(*text, nullptr, false);
  if (!status.is_object()) return fail({settings.status_file, "not a status file of prismrelay"});
  if (as_json) {
    fmt::print("{}\n", printable_json(json_text(status, 2)));
  } else {
    fmt::print("{}", printable_lines(status_view(status, host_time_s())));
  }
  return is_stale(status, host_time_s()) ? kExitFailed : kExitDone;
}

int init(const Settings& settings) {
  if (!settings.postgresql) return fail({settings.path, "postgresql is missing; --init needs a database"}, kExitConfig);
  const auto done = init_schema(*settings.postgresql);
  if (!done) return fail(done.error());
  fmt::print("{}\n", *done);
  return kExitDone;
}

int run(int argc, char** argv) {
  Options options;
  if (const auto code = parse_options(argc, argv, options)) return *code;
  if (const auto scale = check_time_scale(); !scale) return fail(scale.error(), kExitConfig);
  if (options.schema) {
    fmt::print("{}", schema_sql());
    return kExitDone;
  }
  const auto settings = load_settings(options.config);
  if (!settings) return fail(settings.error(), kExitConfig);
  for (const std::string& warning : settings->warnings) fmt::print(stderr, "prismrelay: warning: {}\n", warning);
  if (options.check) {
    fmt::print("{}: good: site {}, to{}{}{}\n", settings->path, settings->site,
               settings->postgresql ? " postgresql" : "", settings->mqtt ? " mqtt" : "",
               settings->metrics ? " metrics" : "");
    return kExitDone;
  }
  if (options.status) return show_status(*settings, options.json);
  if (options.init) return init(*settings);
  run_relay(*settings);
  return kExitDone;
}

}  // namespace
}  // namespace prism::prismrelay

int main(int argc, char** argv) { return prism::prismrelay::run(argc, argv); }
