// SPDX-License-Identifier: MIT
// prismctl: command-line client of prismd.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/outside_text.hpp"
#include "base/text_number.hpp"
#include "base/time_scale.hpp"
#include "config/socket_path.hpp"
#include "config/socket_protocol.hpp"
#include "config/version.hpp"
#include "tools/client/client.hpp"
#include "tools/client/instances.hpp"
#include "tools/command_line.hpp"
#include "tools/metrics/exposition.hpp"
#include "tools/metrics/families.hpp"
#include "tools/prismctl/commands.hpp"
#include "tools/prismctl/views.hpp"
#include "tools/prismctl/words.hpp"

namespace prism::prismctl {
namespace {

using nlohmann::json;

struct Choice {
  std::string socket, name, axis;
  bool json = false, no_start = false;
};

using View = std::string (*)(const json& result);

/// A command that is one request and its text.
struct Command {
  const char* method;
  View view;                                   ///< null: JSON
  const char *option = "", *option_help = "";  ///< a parameter that is an integer of 1 to `most`
  int usual = 0, most = 0;
};

std::string lines_of(const json& list, std::string (*line)(const json&)) {
  std::string text;
  for (const json& entry : list) text += line(entry);
  return text;
}

std::string history_view(const json& history) {
  return each_axis(history, [](const json& rows) { return window_heading() + lines_of(rows, window_line); });
}

std::string version_view(const json& version) {
  return fmt::format("prismctl {}, {} {}\n", kVersion, text_of(at(version, "name"), "prismd"),
                     text_of(at(version, "version"), "?"));
}

constexpr Command kCommands[] = {
    {"status", status_view},
    {"bias", bias_view},
    {"stability", [](const json& s) { return each_axis(s, stability_view); }},
    {"line", line_view},
    {"model", [](const json& m) { return each_axis(m, model_view); }},
    {"config", nullptr},
    {"events", [](const json& e) { return lines_of(e, event_line); }, "count", "number of events", 20, 256},
    {"history", history_view, "seconds", "number of seconds", 60, 3600},
    {"reload", [](const json& r) { return text_of(at(r, "reloaded"), "") + "\n"; }},
    {"version", version_view}};

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

// Sends a request and prints the result with `view`; as JSON without a view and with --json. Methods with a parameter
// "axis" get the chosen one.
int ask(const Choice& choice, const std::string& method, json params, View view) {
  const config::SocketMethod* const known = config::find_method(method);
  if (known->params.starts_with("axis") && !choice.axis.empty()) params["axis"] = choice.axis;
  const auto path = socket_of(choice);
  if (!path) return fail(path.error());
  json result;
  const client::Work work = [&](client::Client& client) -> boost::asio::awaitable<Result<void>> {
    auto response = co_await client.ask(method, params);
    if (!response) co_return tl::unexpected<Error>(response.error().error);
    result = std::move(*response);
    co_return choose_axis(result, choice.axis);
  };
  if (const auto done = client::connected(*path, work); !done) return fail(done.error());
  if (choice.json || view == nullptr) {
    print_json(with_only_axis(result), 2);
  } else {
    print_text(view(result));
  }
  return 0;
}

boost::asio::awaitable<Result<void>> request(client::Client& client, metrics::GyroAnswers& answers) {
  const std::array<std::pair<const char*, nlohmann::json*>, 3> all = {
      {{"status", &answers.status}, {"line", &answers.line}, {"stability", &answers.stability}}};
  for (const auto& [method, answer] : all) {
    auto response = co_await client.ask(method);
    if (!response && response.error().code != config::kGone)
      fmt::print(stderr, "prismctl: {}: {}\n", printable(client.name()), response.error().text());
    if (!response) break;
    *answer = std::move(*response);
  }
  co_return Result<void>();
}

// Writes the metrics of the given socket ($PRISM_SOCKET, too) or instance, else of all sockets in the socket
// directories and of the relays. An instance that does not respond, or that a connection would start, has prism_up 0.
// `file`: empty for standard output.
int metrics(const Choice& choice, const std::string& file) {
  std::map<std::string, std::string> sockets;  // by name: one that runs, else the first
  std::vector<std::string> invalid;
  metrics::Exposition exposition;
  const char* const environment = std::getenv("PRISM_SOCKET");
  if (choice.socket.empty() && choice.name.empty() && (environment == nullptr || *environment == '\0')) {
    for (const std::string& path : client::running_sockets()) sockets[config::instance_name(path)] = path;
    for (const auto& [name, path] : client::list_instances({}, &invalid)) sockets.try_emplace(name, path);
    metrics::add_relays(exposition);
  } else {
    const auto found = client::find_socket(choice.socket, choice.name);
    if (!found) return fail(found.error());
    sockets[config::instance_name(*found)] = *found;
  }
  for (const std::string& path : invalid)
    fmt::print(stderr, "prismctl: {}: the name is skipped, expected {}\n", path, rule_text(TextRule::kName));
  for (const auto& [name, path] : sockets) {
    metrics::GyroAnswers answers;
    const client::Work work = [&](client::Client& client) { return request(client, answers); };
    if (!config::would_start(path)) (void)client::connected(path, work);  // without an answer, it is down
    metrics::add_gyro(exposition, name, answers);
  }
  metrics::add_time(exposition);
  if (file.empty()) {
    fmt::print("{}", exposition.text());
    return 0;
  }
  const auto written = metrics::write_exposition(file, exposition.text());
  return written ? 0 : fail(written.error());
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

int run(int argc, char** argv) {
  if (const auto scale = check_time_scale(); !scale) return fail(scale.error());
  CLI::App app("prismctl: shows the state and data of running prismd instances");
  Choice choice;
  int code = 0;
  // Calls a command with the chosen socket.
  const auto calls = [&](auto command, auto& settings) {
    return [&, command] {
      settings.axis = choice.axis;
      settings.json = choice.json;
      const auto path = socket_of(choice);
      code = path ? command(*path, settings) : fail(path.error());
    };
  };
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

  std::map<std::string_view, int> numbers;  // values of the commands' options
  for (const Command& command : kCommands) {
    const std::string method = command.method, option = command.option;
    auto* declared = app.add_subcommand(method, help_of(method));
    std::string example = fmt::format("prismctl --name gyro1 {} --json", method);
    if (command.most > 0) {
      numbers[command.option] = command.usual;
      declared->add_option("--" + option, numbers[command.option], command.option_help)
          ->check(tools::within(1, command.most))
          ->capture_default_str();
      example = fmt::format("prismctl {} --{} {}", method, option, command.most);
    }
    tools::add_examples(*declared, {"prismctl " + method, example});
    declared->callback([&, method, option] {
      json params;
      if (command.most > 0) params[option] = numbers[command.option];
      code = ask(choice, method, params, command.view);
    });
  }
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
  log->callback(calls(rows, wanted));
  ExportSettings exported;
  auto* copy = app.add_subcommand("export", "write the log's rows of a time span into DIR, as files for prismcal");
  copy->add_option("DIR", exported.directory, "a new directory")->required()->type_name("");
  copy->add_option("--from", exported.from, "first time, UTC: 2026-11-23T09:11:00 (default: all that is kept)")
      ->type_name("TIME");
  copy->add_option("--to", exported.to, "end, not included, UTC")->type_name("TIME");
  tools::add_examples(*copy, {"prismctl --name gyro1 export cycle1 --from 2026-11-21T10:15 --to 2026-11-22T11:57"});
  copy->callback(calls(export_log, exported));
  std::string file;
  auto* exposition = app.add_subcommand("metrics", "state of all instances of this host in Prometheus' text format");
  exposition->add_option("--file", file,
                         "write to this file, atomically: a .prom file in node_exporter's textfile directory");
  tools::add_examples(*exposition,
                      {"prismctl metrics", "prismctl metrics --file /var/lib/prometheus/node-exporter/prism.prom"});
  exposition->callback([&] { code = metrics(choice, file); });
  std::vector<std::string> words;
  std::string line;
  bool hex = false;
  auto* bytes = app.add_subcommand("send", help_of("send") + ", if its configuration has \"allow_send\": true");
  bytes->add_option("TEXT", words, "the text; before it, the instance as with --name; \\r \\n \\t \\xHH are bytes")
      ->required()
      ->expected(1, 2)
      ->type_name("");
  bytes->add_option("--line", line, "sensor line (default: the gyro's)")
      ->check(tools::following(TextRule::kSensorName));
  bytes->add_flag("--hex", hex, "TEXT is bytes in hex: \"55 AA\"");
  tools::add_examples(*bytes, {"prismctl send gyro1 '=config,0\\r\\n'", "prismctl send --hex 'FA FF 10 00 F1'"});
  bytes->callback([&] {
    if (words.size() == 2) choice.name = words.front();
    json params = {{"hex", hex ? words.back() : hex_of_escaped(words.back())}};
    if (!line.empty()) params["line"] = line;
    code = ask(choice, "send", params,
               [](const json& r) { return fmt::format("sent {} bytes\n", json_text(at(r, "sent"))); });
  });
  double offset = 0, expires_s = 0;
  bool clears = false;
  std::string reason;
  auto* changed = app.add_subcommand("offset", help_of("offset") + ": for root or the user that prismd runs as");
  auto* value = changed->add_option("--set", offset, "deg/h, subtracted besides the model's bias");
  auto* why = changed->add_option("--reason", reason, "text for the event and status")
                  ->check(tools::following(TextRule::kText));
  changed->add_option("--expires", expires_s, "time until it ends, such as 8h or 2d (default: until --clear)")
      ->transform(CLI::AsNumberWithUnit(std::map<std::string, double>{{"s", 1}, {"min", 60}, {"h", 3600}, {"d", 86400}},
                                        CLI::AsNumberWithUnit::UNIT_REQUIRED))
      ->type_name("TIME")
      ->needs(value);
  auto* clear = changed->add_flag("--clear", clears, "end it")->excludes(value);
  value->needs(why);
  tools::add_examples(*changed, {"prismctl --name gyro1 offset --set 0.002 --reason 'turn-on of 29 Nov' --expires 8h",
                                 "prismctl --name gyro1 offset --clear"});
  changed->callback([&] {
    if (value->empty() && clear->empty()) throw CLI::RequiredError("--set or --clear");
    json params = {{"clear", true}};
    if (!value->empty()) params = {{"deg_per_h", offset}, {"reason", reason}};
    if (expires_s > 0) params["expires_s"] = std::llround(expires_s);
    code = ask(choice, "offset", params, [](const json& r) { return text_of(at(r, "offset"), "") + "\n"; });
  });
  WatchSettings watched;
  auto* live = app.add_subcommand("watch", "live screen on a terminal; otherwise lines or, with --json, JSON");
  live->add_flag("--samples", watched.samples, "print every sample instead of one row a second");
  live->add_option("--every", watched.every, "with --samples: every n-th sample only")
      ->check(tools::within(1, 1000000));
  live->add_option("--count", watched.count, "stop after N rows");
  tools::add_examples(*live, {"prismctl watch", "prismctl --json watch --samples --every 10 --count 100"});
  live->callback(calls(watch, watched));

  return tools::parse(app, "prismctl", argc, argv).value_or(code);
}

}  // namespace
}  // namespace prism::prismctl

int main(int argc, char** argv) { return prism::prismctl::run(argc, argv); }
