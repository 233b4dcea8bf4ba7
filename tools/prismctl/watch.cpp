// SPDX-License-Identifier: MIT
#include "tools/prismctl/watch.hpp"

#include <fmt/format.h>
#include <signal.h>

#include <cstdio>

#include "tools/prismctl/screen/terminal.hpp"
#include "tools/prismctl/screen/watch_screen.hpp"
#include "tools/prismctl/text_view.hpp"
#include "tools/prismctl/words.hpp"

namespace prism::prismctl {
namespace {

using nlohmann::json;

volatile sig_atomic_t g_stop = 0;

void stop_on_signal() {
  struct sigaction action {};
  action.sa_handler = [](int) { g_stop = 1; };
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  ::signal(SIGPIPE, SIG_IGN);
}

void print_row(const std::string& method, const json& params, const WatchSettings& settings) {
  if (settings.json) return void(fmt::print("{}\n", json{{"method", method}, {"params", params}}.dump()));
  if (method == "event") return void(fmt::print("# {}", event_line(params)));
  if (method == "lost") return void(fmt::print("# {} rows lost: this reader was too slow\n", params.value("rows", 0)));
  json row = params;
  if (method == "sample") {
    row["mean_rate_deg_per_h"] = row.value("rate_deg_per_h", json());
    row["corrected_mean_deg_per_h"] = row.value("corrected_deg_per_h", json());
    row["mean_temperature_degc"] = row.value("temperature_degc", json());
    row["mean_uhfo_v"] = row.value("uhfo_v", json());
  }
  fmt::print("{}{}", settings.several ? fmt::format("{:<5}", row.value("axis", "")) : "", window_line(row));
}

int watch_lines(const std::string& socket, WatchSettings settings) {
  auto connection = client::Connection::open(socket);
  const std::string stream = settings.samples ? "sample" : "window";
  json wanted = {{"streams", {stream, "event"}}, {"every", settings.every}};
  if (!settings.axis.empty()) wanted["axes"] = {settings.axis};
  auto subscribed =
      connection ? connection->ask("subscribe", wanted) : Result<json>(tl::unexpected<Error>(connection.error()));
  if (!subscribed) {
    fmt::print(stderr, "prismctl: {}\n", subscribed.error().text());
    return 1;
  }
  settings.several = at(*subscribed, "axes").size() > 1;
  if (!settings.json) fmt::print("{}{}", settings.several ? "axis " : "", window_heading());
  std::uint64_t rows = 0;
  while (!g_stop) {
    const auto message = connection->next(-1);
    if (!message) {
      fmt::print(stderr, "prismctl: {}\n", message.error().text());
      return 1;
    }
    if (!*message) continue;
    const std::string method = (**message).value("method", "");
    if (method.empty()) continue;
    print_row(method, (**message).value("params", json::object()), settings);
    if (std::fflush(stdout) != 0) return 0;  // the reader behind the pipe has seen enough
    if (method == stream && ++rows == settings.count) break;
  }
  return 0;
}

}  // namespace

int watch(const std::string& socket, const WatchSettings& settings) {
  const bool screen = screen::terminal_has_screen() && !settings.json && !settings.samples && settings.count == 0;
  if (screen) return screen::watch_screen(socket, settings.axis);
  stop_on_signal();
  return watch_lines(socket, settings);
}

}  // namespace prism::prismctl
