// SPDX-License-Identifier: MIT
#include "tools/prismctl/watch.hpp"

#include <fmt/format.h>
#include <signal.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "tools/prismctl/output.hpp"
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
  if (settings.json) return print_json(json{{"method", method}, {"params", params}});
  if (method == "event") return print_text("# " + event_line(params));
  if (method == "lost")
    return print_text(fmt::format("# {} rows lost: this client read too slowly\n", count_text(at(params, "rows"))));
  json row = params;
  if (method == "sample" && row.is_object()) {
    row["mean_rate_deg_per_h"] = at(params, "rate_deg_per_h");
    row["corrected_mean_deg_per_h"] = at(params, "corrected_deg_per_h");
    row["mean_temperature_degc"] = at(params, "temperature_degc");
    row["mean_uhfo_v"] = at(params, "uhfo_v");
  }
  print_text((settings.several ? fmt::format("{:<5}", text_of(at(row, "axis"), "")) : "") + window_line(row));
}

int watch_lines(const std::string& socket, WatchSettings settings) {
  auto connection = client::DaemonConnection::open(socket);
  const std::string stream = settings.samples ? "sample" : "window";
  json wanted = {{"streams", {stream, "event"}}, {"every", settings.every}};
  if (!settings.axis.empty()) wanted["axes"] = {settings.axis};
  const auto fail = [](const std::string& why) {
    fmt::print(stderr, "prismctl: {}\n", why);
    return 1;
  };
  if (!connection) return fail(connection.error().text());
  const auto subscribed = connection->ask("subscribe", wanted);
  if (!subscribed) return fail(subscribed.error().text());
  settings.several = at(*subscribed, "axes").size() > 1;
  if (!settings.json) fmt::print("{}{}", settings.several ? "axis " : "", window_heading());
  std::uint64_t rows = 0;
  while (!g_stop) {
    const auto message = connection->next(-1);
    if (!message) return fail(message.error().text());
    if (!*message) continue;
    const std::string method = text_member(**message, "method");
    if (method.empty()) continue;
    print_row(method, at(**message, "params"), settings);
    if (std::fflush(stdout) != 0) return 0;  // the reader closed the pipe
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
