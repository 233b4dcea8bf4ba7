// SPDX-License-Identifier: MIT
#include "tools/prismctl/commands.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <functional>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "base/escape.hpp"
#include "base/hex_bytes.hpp"
#include "base/outside_text.hpp"
#include "base/result.hpp"
#include "base/time_scale.hpp"
#include "config/socket_path.hpp"
#include "config/socket_protocol.hpp"
#include "config/version.hpp"
#include "tools/client/connection.hpp"
#include "tools/command_line.hpp"
#include "tools/prismctl/axes_view.hpp"
#include "tools/prismctl/export.hpp"
#include "tools/prismctl/metrics.hpp"
#include "tools/prismctl/model_view.hpp"
#include "tools/prismctl/output.hpp"
#include "tools/prismctl/rows.hpp"
#include "tools/prismctl/text_view.hpp"
#include "tools/prismctl/watch.hpp"
#include "tools/prismctl/words.hpp"

namespace prism::prismctl {
namespace {

constexpr int kDone = 0, kFailed = 1, kUsage = 64;

int fail(const Error& error) {
  fmt::print(stderr, "prismctl: {}\n", error.text());
  return kFailed;
}

using View = std::function<std::string(const nlohmann::json&)>;

struct Choice {
  std::string socket, name, axis;
  bool json = false, no_start = false;
};

// The socket to use. Reports or refuses a connection at which systemd starts the instance.
Result<std::string> socket_of(const Choice& choice) {
  auto path = client::find_socket(choice.socket, choice.name);
  if (!path || !config::would_start(*path)) return path;
  const std::string name = config::instance_name(*path);
  if (choice.no_start) return make_error(name, "is stopped; without --no-start, systemd would start it");
  fmt::print(stderr, "prismctl: {} was stopped; systemd starts it for this request (--no-start prevents this)\n",
             printable(name));
  return path;
}

// Removes the other axes from a result. Errors: the result has axes, but not this one.
Result<void> choose_axis(nlohmann::json& result, const std::string& axis) {
  if (axis.empty() || !at(result, "axes").is_object()) return {};
  nlohmann::json& axes = result["axes"];
  if (!axes.contains(axis)) {
    std::vector<std::string> names;
    for (const auto& [name, own] : axes.items()) names.push_back(name);
    return make_error("--axis", fmt::format("found {}, expected one of {}", axis, fmt::join(names, ", ")));
  }
  for (auto own = axes.begin(); own != axes.end();) own = own.key() == axis ? std::next(own) : axes.erase(own);
  return {};
}

// Sends a request and prints the result with `view`; as JSON without a view and with --json. Methods with a parameter
// "axis" get the chosen one.
int ask(const Choice& choice, const std::string& method, nlohmann::json params, const View& view) {
  const config::SocketMethod* const known = config::find_method(method);
  const bool has_axis = known != nullptr && known->params.starts_with("axis");
  if (has_axis && !choice.axis.empty()) params["axis"] = choice.axis;
  const auto path = socket_of(choice);
  if (!path) return fail(path.error());
  auto connection = client::DaemonConnection::open(*path);
  if (!connection) return fail(connection.error());
  auto answer = connection->ask(method, params);
  if (!answer) return fail(answer.error().error);
  if (const auto chosen = choose_axis(*answer, choice.axis); !chosen) return fail(chosen.error());
  if (choice.json || !view) {
    print_json(with_only_axis(*answer), 2);
  } else {
    print_text(view(*answer));
  }
  return kDone;
}

std::string lines_of(const nlohmann::json& list, std::string (*line)(const nlohmann::json&)) {
  std::string text;
  for (const nlohmann::json& entry : list) text += line(entry);
  return text;
}

// Methods with other parameters than the axis have commands with options; version and reload print one line.
bool has_own_command(const config::SocketMethod& method) {
  return method.name == "version" || method.acts || method.is_long;
}

// The view of a method; empty if its result is printed as JSON.
View view_of(std::string_view method) {
  static const std::map<std::string_view, View> kViews = {
      {"status", status_view},
      {"bias", bias_view},
      {"stability", [](const nlohmann::json& s) { return each_axis(s, stability_view); }},
      {"line", line_view},
      {"model", [](const nlohmann::json& m) { return each_axis(m, model_view); }}};
  const auto found = kViews.find(method);
  return found != kViews.end() ? found->second : nullptr;
}

// The bytes of a text in hex. In the text, `\r`, `\n`, `\t`, `\\` and `\xHH` are one byte each.
std::string hex_of_escaped(std::string_view text) {
  std::string hex;
  const auto add = [&hex](char c) { hex += fmt::format("{:02x}", static_cast<unsigned char>(c)); };
  constexpr std::string_view kNames = "rnt\\", kBytes = "\r\n\t\\";
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::string_view rest = text.substr(i + 1);
    const std::size_t known = text[i] == '\\' && !rest.empty() ? kNames.find(rest.front()) : std::string_view::npos;
    if (known != std::string_view::npos) {
      add(kBytes[known]);
      ++i;
    } else if (text[i] == '\\' && rest.starts_with('x') && hex_bytes(rest.substr(1, 2)).size() == 1 &&
               rest.size() > 2) {
      hex += rest.substr(1, 2);
      i += 3;
    } else {
      add(text[i]);
    }
  }
  return hex;
}

std::string help_of(std::string_view method) { return std::string(config::find_method(method)->help); }

struct SendSettings {
  std::vector<std::string> words;
  std::string line;
  bool hex = false;
};

CLI::App* declare_send(CLI::App& app, SendSettings& settings) {
  auto* command = app.add_subcommand("send", help_of("send") + ", if its configuration has \"allow_send\": true");
  command
      ->add_option("TEXT", settings.words,
                   "the text; before it, the instance as with --name; \\r \\n \\t \\xHH are bytes")
      ->required()
      ->expected(1, 2)
      ->type_name("");
  command->add_option("--line", settings.line, "sensor line (default: the gyro's)")
      ->check(tools::following(TextRule::kSensorName));
  command->add_flag("--hex", settings.hex, "TEXT is bytes in hex: \"55 AA\"");
  tools::add_examples(*command, {"prismctl send gyro1 '=config,0\\r\\n'", "prismctl send --hex 'FA FF 10 00 F1'"});
  return command;
}

int send(Choice choice, const SendSettings& settings) {
  if (settings.words.size() == 2) choice.name = settings.words.front();
  const std::string& given = settings.words.back();
  nlohmann::json params = {{"hex", settings.hex ? given : hex_of_escaped(given)}};
  if (!settings.line.empty()) params["line"] = settings.line;
  return ask(choice, "send", params,
             [](const nlohmann::json& r) { return fmt::format("sent {} bytes\n", json_text(at(r, "sent"))); });
}

}  // namespace

int run(int argc, char** argv) {
  if (const auto scale = check_time_scale(); !scale) return fail(scale.error());
  CLI::App app("prismctl: shows the state and data of running prismd instances");
  Choice choice;
  int code = kDone;
  tools::use_readable_help(app);
  app.set_version_flag("--version", std::string("prismctl ") + kVersion);
  app.add_option("-s,--socket", choice.socket,
                 "path of the daemon's socket (default: $PRISM_SOCKET, or the only running instance)");
  app.add_option("-n,--name", choice.name, "instance, required if several run")
      ->check(tools::following(TextRule::kName));
  app.add_option("--axis", choice.axis, "axis of a device with several axes (default: all)")
      ->check(tools::following(TextRule::kAxisName));
  app.add_flag("--json", choice.json, "print JSON");
  app.add_flag("--no-start", choice.no_start, "do not start a stopped instance: fail");
  app.require_subcommand(1);
  app.fallthrough();
  tools::add_examples(app, {"prismctl status", "prismctl --name gyro1 watch"});

  for (const config::SocketMethod& method : config::kSocketMethods) {
    if (has_own_command(method)) continue;
    const std::string name(method.name);
    auto* command = app.add_subcommand(name, std::string(method.help));
    command->callback([&choice, &code, name] { code = ask(choice, name, nullptr, view_of(name)); });
    tools::add_examples(*command, {"prismctl " + name, fmt::format("prismctl --name gyro1 {} --json", name)});
  }
  int count = 20, seconds = 60;
  auto* events = app.add_subcommand("events", help_of("events"));
  events->add_option("--count", count, "number of events")->check(tools::within(1, 256))->capture_default_str();
  tools::add_examples(*events, {"prismctl events --count 50"});
  events->callback([&] {
    code = ask(choice, "events", {{"count", count}}, [](const nlohmann::json& e) { return lines_of(e, event_line); });
  });
  auto* history = app.add_subcommand("history", help_of("history"));
  history->add_option("--seconds", seconds, "number of seconds")->check(tools::within(1, 3600))->capture_default_str();
  tools::add_examples(*history, {"prismctl history --seconds 600"});
  history->callback([&] {
    code = ask(choice, "history", {{"seconds", seconds}}, [](const nlohmann::json& answer) {
      return each_axis(answer,
                       [](const nlohmann::json& rows) { return window_heading() + lines_of(rows, window_line); });
    });
  });
  RowsSettings wanted;
  auto* log =
      app.add_subcommand("rows", help_of("rows") + ", as CSV, or JSON with --json; --follow waits for new rows");
  log->add_option("--after", wanted.after, "cursor from an earlier call, earliest or latest (default: earliest)")
      ->check(tools::following(TextRule::kText));
  log->add_option("--cursor", wanted.cursor_file,
                  "file that stores the cursor: the next call continues where this one ended");
  log->add_option("--limit", wanted.limit, "stop after N rows")->check(tools::positive());
  log->add_flag("--follow", wanted.follow, "wait for new rows, also while prismd restarts");
  tools::add_examples(*log,
                      {"prismctl rows --after latest --follow", "prismctl rows --cursor fetched --json >>gyro1.jsonl"});
  log->callback([&] {
    wanted.json = choice.json;
    wanted.axis = choice.axis;
    const auto path = socket_of(choice);
    code = path ? rows(*path, wanted) : fail(path.error());
  });
  ExportSettings exported;
  auto* copy = app.add_subcommand("export", "write the log's rows of a time span into DIR, as files for prismcal");
  copy->add_option("DIR", exported.directory, "a new directory")->required()->type_name("");
  copy->add_option("--from", exported.from, "first time, UTC: 2026-11-23T09:11:00 (default: all that is kept)")
      ->type_name("TIME");
  copy->add_option("--to", exported.to, "end, not included, UTC")->type_name("TIME");
  tools::add_examples(*copy, {"prismctl --name gyro1 export cycle1 --from 2026-11-21T10:15 --to 2026-11-22T11:57"});
  copy->callback([&] {
    exported.axis = choice.axis;
    const auto path = socket_of(choice);
    code = path ? export_log(*path, exported) : fail(path.error());
  });
  std::string file;
  auto* exposition = app.add_subcommand("metrics", "state of all instances of this host in Prometheus' text format");
  exposition->add_option("--file", file,
                         "write to this file, atomically: a .prom file in node_exporter's textfile directory");
  tools::add_examples(*exposition,
                      {"prismctl metrics", "prismctl metrics --file /var/lib/prometheus/node-exporter/prism.prom"});
  exposition->callback([&] { code = metrics(choice.socket, choice.name, file); });
  auto* reload = app.add_subcommand("reload", help_of("reload"));
  tools::add_examples(*reload, {"prismctl reload"});
  reload->callback([&] {
    code =
        ask(choice, "reload", nullptr, [](const nlohmann::json& r) { return text_of(at(r, "reloaded"), "") + "\n"; });
  });
  SendSettings sent;
  declare_send(app, sent)->callback([&] { code = send(choice, sent); });
  auto* version = app.add_subcommand("version", help_of("version"));
  tools::add_examples(*version, {"prismctl version"});
  version->callback([&] {
    code = ask(choice, "version", nullptr, [](const nlohmann::json& v) {
      return fmt::format("prismctl {}, {} {}\n", kVersion, text_of(at(v, "name"), "prismd"),
                         text_of(at(v, "version"), "?"));
    });
  });

  WatchSettings settings;
  auto* live = app.add_subcommand("watch", "live screen on a terminal; otherwise lines or, with --json, JSON");
  live->add_flag("--samples", settings.samples, "print every sample instead of one row a second");
  live->add_option("--every", settings.every, "with --samples: every n-th sample only")
      ->check(tools::within(1, 1000000));
  live->add_option("--count", settings.count, "stop after N rows");
  tools::add_examples(*live, {"prismctl watch", "prismctl --json watch --samples --every 10 --count 100"});
  live->callback([&] {
    settings.json = choice.json;
    settings.axis = choice.axis;
    const auto path = socket_of(choice);
    code = path ? watch(*path, settings) : fail(path.error());
  });

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    const std::string unknown = tools::unknown_command(app, argc, argv);
    fmt::print(stderr, "prismctl: {} (see prismctl --help)\n", printable(unknown.empty() ? error.what() : unknown));
    return kUsage;
  }
  return code;
}

}  // namespace prism::prismctl
