// SPDX-License-Identifier: MIT
// prismrelay: sends the rows of this host's prismds to PostgreSQL, and their state to MQTT.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/host_time.hpp"
#include "base/json_member.hpp"
#include "base/plain_text.hpp"
#include "base/text_number.hpp"
#include "base/time_scale.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/metrics/families.hpp"
#include "tools/prismrelay/database.hpp"
#include "tools/prismrelay/relay.hpp"

namespace prism::prismrelay {
namespace {

using nlohmann::json;

constexpr int kExitDone = 0, kExitFailed = 1, kExitConfig = 78;

struct Options {
  std::string config = "/etc/prism/relay.json";
  bool check = false, schema = false, init = false, status = false, json = false;
};

/// Returns an exit code after help, version or a usage error, else nullopt.
std::optional<int> parse_options(int argc, char** argv, Options& options) {
  CLI::App app("prismrelay: sends the rows of all gyros of this host to PostgreSQL, and their state to MQTT");
  tools::use_readable_help(app);
  app.set_version_flag("--version", std::string("prismrelay ") + kVersion);
  app.add_option("config", options.config, "configuration file")->capture_default_str();
  const std::array tasks = {
      app.add_flag("--check", options.check, "validate the configuration and exit"),
      app.add_flag("--schema", options.schema, "print the SQL of --init and exit"),
      app.add_flag("--init", options.init, "create or update the tables in the configured database and exit"),
      app.add_flag("--status", options.status, "print the running relay's status; exit 1 if none")};
  for (auto* one : tasks) {
    for (auto* other : tasks) one == other ? nullptr : one->excludes(other);
  }
  app.add_flag("--json", options.json, "with --status: print JSON")->needs(tasks.back());
  tools::add_examples(app, {"prismrelay --init /etc/prism/relay.json", "prismrelay --status"});
  return tools::parse(app, "prismrelay", argc, argv);
}

int fail(const Error& error, int code = kExitFailed) {
  fmt::print(stderr, "prismrelay: {}\n", error.text());
  return code;
}

std::string time_text(const json& time_s) {
  if (!time_s.is_number() || !(std::abs(time_s.get<double>()) < 9e15)) return "never";
  return utc_text(static_cast<std::int64_t>(time_s.get<double>()));
}

// A printable text of a status file.
std::string printable_member(const json& object, const char* key) { return printable(text_member(object, key)); }

// ": REASON", or nothing.
std::string reason(const json& object) {
  const std::string error = printable_member(object, "error");
  return error.empty() ? "" : ": " + error;
}

std::string target_view(const std::string& name, const json& target) {
  const auto dropped = count_member(target, "dropped_messages");
  return fmt::format("{:<12}{} since {}{}{}\n", printable(name), flag_member(target, "up") ? "up" : "DOWN",
                     time_text(member(target, "since_s")), reason(target),
                     dropped > 0 ? fmt::format("; {} messages dropped", dropped) : "");
}

std::string log_view(const json& log) {
  const std::string error = reason(log);
  const double late_s = number_member(log, "behind_s");
  const auto missing = count_member(log, "missing_rows"), invalid = count_member(log, "refused_rows");
  std::string state = error.empty() || late_s > 0 ? fmt::format("{:.0f} s behind", late_s) : "not sending";
  if (error.empty() && flag_member(log, "caught_up")) state = "up to date";
  if (missing > 0) state += ", " + counted(missing, "row") + " deleted before sending";
  if (invalid > 0) state += ", " + counted(invalid, "invalid line");
  return fmt::format("{:<24}axis {}: {} rows, {}{}\n", printable_member(log, "gyro"), printable_member(log, "axis"),
                     count_member(log, "rows"), state, error);
}

// For a person. `age_s`: its age if it is stale.
std::string status_view(const json& status, std::optional<double> age_s) {
  std::string text;
  if (age_s)
    text += fmt::format("prismrelay has stopped or stalled; last status at {}, {:.0f} s ago\n",
                        time_text(member(status, "time_s")), *age_s);
  text += fmt::format("site        {}\n", printable_member(status, "site"));
  for (const auto& [name, target] : member(status, "targets").items()) text += target_view(name, target);
  for (const auto& [gyro, instance] : member(status, "instances").items()) {
    text += fmt::format("{:<24}{}{}\n", printable(gyro), printable_member(instance, "state"), reason(instance));
  }
  for (const json& log : member(status, "logs")) text += log_view(log);
  return text;
}

int show_status(const Settings& settings, bool as_json) {
  const auto text = read_text_file(settings.status_file);
  if (!text) return fail({settings.status_file, "cannot read the status; is prismrelay running?"});
  const auto status = json::parse(*text, nullptr, false);
  if (!status.is_object()) return fail({settings.status_file, "not a status file of prismrelay"});
  const double age_s = host_time_s() - number_member(status, "time_s");
  const bool is_stale = age_s > metrics::kRelayTimeout_s;
  if (as_json) {
    fmt::print("{}\n", printable_json(json_text(status, 2)));
  } else {
    fmt::print("{}", printable_lines(status_view(status, is_stale ? std::optional(age_s) : std::nullopt)));
  }
  return is_stale ? kExitFailed : kExitDone;
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
    fmt::print("{}: good: site {}, to{}{}\n", settings->path, settings->site, settings->postgresql ? " postgresql" : "",
               settings->mqtt ? " mqtt" : "");
    return kExitDone;
  }
  if (options.status) return show_status(*settings, options.json);
  if (options.init) {
    if (!settings->postgresql) return fail({settings->path, "no postgresql, which --init needs"}, kExitConfig);
    const auto done = init_schema(*settings->postgresql);
    if (!done) return fail(done.error());
    fmt::print("{}\n", *done);
  } else {
    run_relay(*settings);
  }
  return kExitDone;
}

}  // namespace
}  // namespace prism::prismrelay

int main(int argc, char** argv) { return prism::prismrelay::run(argc, argv); }
