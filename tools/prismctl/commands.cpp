// SPDX-License-Identifier: MIT
#include "tools/prismctl/commands.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismctl/connection.hpp"
#include "tools/prismctl/text_view.hpp"
#include "tools/prismctl/watch.hpp"

namespace prism::prismctl {
namespace {

constexpr int kDone = 0, kFailed = 1, kUsage = 64;

int fail(const Error& error) {
  fmt::print(stderr, "prismctl: {}\n", error.text());
  return kFailed;
}

struct Choice {
  std::string socket, name;
  bool json = false;
};

// One question, one answer, printed as `view` says or as JSON.
int ask(const Choice& choice, const std::string& method, const nlohmann::json& params,
        const std::function<std::string(const nlohmann::json&)>& view) {
  const auto path = find_socket(choice.socket, choice.name);
  if (!path) return fail(path.error());
  auto connection = Connection::open(*path);
  if (!connection) return fail(connection.error());
  const auto answer = connection->ask(method, params);
  if (!answer) return fail(answer.error());
  fmt::print("{}", choice.json ? answer->dump(2) + "\n" : view(*answer));
  return kDone;
}

std::string lines_of(const nlohmann::json& list, std::string (*line)(const nlohmann::json&)) {
  std::string text;
  for (const nlohmann::json& entry : list) text += line(entry);
  return text;
}

}  // namespace

int run(int argc, char** argv) {
  CLI::App app("prismctl: asks a running prismd about its gyro");
  Choice choice;
  int code = kDone;
  tools::speak_to_people(app);
  app.set_version_flag("--version", std::string("prismctl ") + kVersion);
  app.add_option("-s,--socket", choice.socket,
                 "path of the daemon's socket (default: $PRISM_SOCKET, or the only one running)");
  app.add_option("-n,--name", choice.name, "instance, where several run");
  app.add_flag("--json", choice.json, "print JSON, for programs");
  app.require_subcommand(1);
  app.fallthrough();
  tools::add_examples(app, {"prismctl status", "prismctl --name gyro1 watch"});

  const auto question = [&](const char* name, const char* help, std::string (*view)(const nlohmann::json&)) {
    auto* command = app.add_subcommand(name, help);
    command->callback([&choice, &code, name, view] { code = ask(choice, name, nullptr, view); });
    tools::add_examples(*command,
                        {std::string("prismctl ") + name, fmt::format("prismctl --name gyro1 {} --json", name)});
  };
  question("status", "state of the line, last values, counters", status_view);
  question("bias", "the corrected bias now", bias_view);
  question("stability", "bias stability raw and corrected since the start", stability_view);
  question("line", "health of the serial line: frames, refusals, clock, hardware errors", line_view);
  question("model", "the model in use and where it is from", model_view);
  question("config", "the configuration in force", [](const nlohmann::json& c) { return c.dump(2) + "\n"; });

  int count = 20, seconds = 60;
  auto* events = app.add_subcommand("events", "what happened, the newest last");
  events->add_option("--count", count, "how many")->check(CLI::Range(1, 256))->capture_default_str();
  tools::add_examples(*events, {"prismctl events --count 50"});
  events->callback([&] {
    code = ask(choice, "events", {{"count", count}}, [](const nlohmann::json& e) { return lines_of(e, event_line); });
  });
  auto* history = app.add_subcommand("history", "the last seconds, one row each");
  history->add_option("--seconds", seconds, "how many")->check(CLI::Range(1, 3600))->capture_default_str();
  tools::add_examples(*history, {"prismctl history --seconds 600"});
  history->callback([&] {
    code = ask(choice, "history", {{"seconds", seconds}},
               [](const nlohmann::json& rows) { return window_heading() + lines_of(rows, window_line); });
  });
  auto* reload = app.add_subcommand("reload", "read the configuration and the models again");
  tools::add_examples(*reload, {"prismctl reload"});
  reload->callback([&] {
    code = ask(choice, "reload", nullptr, [](const nlohmann::json& r) { return r.value("reloaded", "") + "\n"; });
  });
  auto* version = app.add_subcommand("version", "of prismctl and of the daemon");
  tools::add_examples(*version, {"prismctl version"});
  version->callback([&] {
    code = ask(choice, "version", nullptr, [](const nlohmann::json& v) {
      return fmt::format("prismctl {}, {} {}\n", kVersion, v.value("name", "prismd"), v.value("version", "?"));
    });
  });

  WatchSettings settings;
  auto* live = app.add_subcommand("watch", "a live screen on a terminal; lines or --json elsewhere");
  live->add_flag("--samples", settings.samples, "every sample instead of one row a second");
  live->add_option("--every", settings.every, "with --samples: every n-th")->check(CLI::Range(1, 1000000));
  live->add_option("--count", settings.count, "end after so many rows");
  tools::add_examples(*live, {"prismctl watch", "prismctl --json watch --samples --every 10 --count 100"});
  live->callback([&] {
    settings.json = choice.json;
    const auto path = find_socket(choice.socket, choice.name);
    code = path ? watch(*path, settings) : fail(path.error());
  });

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    const std::string unknown = tools::unknown_command(app, argc, argv);
    fmt::print(stderr, "prismctl: {} (see prismctl --help)\n", unknown.empty() ? error.what() : unknown);
    return kUsage;
  }
  return code;
}

}  // namespace prism::prismctl
