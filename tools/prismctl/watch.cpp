// SPDX-License-Identifier: MIT
#include "tools/prismctl/watch.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <optional>

#include "tools/prismctl/plot.hpp"
#include "tools/prismctl/text_view.hpp"

namespace prism::prismctl {
namespace {

using nlohmann::json;

volatile sig_atomic_t g_stop = 0;

void stop_on_signal() {
  struct sigaction action {};
  action.sa_handler = [](int) { g_stop = 1; };
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  action.sa_handler = [](int) {};
  ::sigaction(SIGWINCH, &action, nullptr);
  ::signal(SIGPIPE, SIG_IGN);
}

bool utf8_terminal() {
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    const char* value = std::getenv(name);
    if (value != nullptr && *value != '\0')
      return std::strstr(value, "UTF-8") != nullptr || std::strstr(value, "utf8") != nullptr;
  }
  return false;
}

// The other screen of the terminal, without a cursor; back to the old one when it goes.
class Screen {
 public:
  Screen() { put("\033[?1049h\033[?25l"); }
  ~Screen() { put("\033[?25h\033[?1049l"); }
  void draw(const std::vector<std::string>& lines) {
    winsize size{};
    if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row == 0) size = {24, 80, 0, 0};
    std::string text = "\033[H";
    for (std::size_t i = 0; i < lines.size() && i + 1 < size.ws_row; ++i) text += lines[i] + "\033[K\n";
    put(text + "\033[J");
  }
  static PlotSize plot_size() {
    winsize size{};
    if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row == 0) size = {24, 80, 0, 0};
    return {std::clamp(size.ws_col - 14, 10, 200), std::clamp((size.ws_row - 14) / 2, 2, 12), utf8_terminal()};
  }

 private:
  static void put(const std::string& text) {
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
  }
};

// What the screen shows: the last status, and the means of the last hour.
class View {
 public:
  void status(const json& status) { status_ = status; }
  void history(const json& rows) {
    raw_.clear(), corrected_.clear();
    for (const json& row : rows) window(row);
  }
  void window(const json& row) {
    status_["window"] = row;
    push(raw_, row.value("mean_rate_deg_per_h", json()));
    push(corrected_, row.value("corrected_mean_deg_per_h", json()));
  }
  void sample(const json& row) { status_["sample"] = row; }
  void event(const json& event) {
    events_.push_back(event_line(event));
    if (events_.size() > 3) events_.pop_front();
  }
  std::vector<std::string> lines(const std::string& note) const {
    std::vector<std::string> lines;
    const std::string text = status_view(status_);
    for (std::size_t begin = 0, end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
      lines.push_back(text.substr(begin, end - begin));
    }
    const PlotSize size = Screen::plot_size();
    const auto add_plot = [&](const char* title, const std::deque<double>& values) {
      lines.push_back(fmt::format("{} (100 s mean, deg/h, last {} s)", title, values.size()));
      for (std::string& line : plot({values.begin(), values.end()}, size)) lines.push_back(std::move(line));
    };
    add_plot("raw", raw_);
    add_plot("corrected", corrected_);
    for (const std::string& event : events_) lines.push_back(event.substr(0, event.size() - 1));
    if (!note.empty()) lines.push_back(note);
    return lines;
  }

 private:
  static void push(std::deque<double>& values, const json& value) {
    values.push_back(value.is_number() ? value.get<double>() : std::nan(""));
    if (values.size() > 3600) values.pop_front();
  }
  json status_;
  std::deque<double> raw_, corrected_;
  std::deque<std::string> events_;
};

Result<void> start(Connection& connection, View& view) {
  const auto status = connection.ask("status");
  if (!status) return tl::unexpected<Error>(status.error());
  view.status(*status);
  const auto history = connection.ask("history", {{"seconds", 3600}});
  if (!history) return tl::unexpected<Error>(history.error());
  view.history(*history);
  const auto subscribed = connection.ask("subscribe", {{"streams", {"sample", "window", "event"}}, {"every", 20}});
  if (!subscribed) return tl::unexpected<Error>(subscribed.error());
  return {};
}

// Draws until a signal or until the daemon is gone; the reason, where it is gone.
std::string show(Connection& connection, Screen& screen, View& view) {
  if (auto started = start(connection, view); !started) return started.error().text();
  constexpr int kRefreshMs = 1000;
  screen.draw(view.lines(""));
  while (!g_stop) {
    const auto message = connection.next(kRefreshMs);
    if (!message) return message.error().text();
    if (!*message) {
      screen.draw(view.lines(""));
      continue;
    }
    const std::string method = (**message).value("method", "");
    const json params = (**message).value("params", json());
    if (method == "sample") view.sample(params);
    if (method == "event") {
      view.event(params);
      if (const auto status = connection.ask("status")) view.status(*status);
    }
    if (method == "window") view.window(params);
    if (method == "window" || method == "event") screen.draw(view.lines(""));
  }
  return "";
}

int watch_screen(const std::string& socket) {
  Screen screen;
  View view;
  while (!g_stop) {
    auto connection = Connection::open(socket);
    const std::string gone = connection ? show(*connection, screen, view) : connection.error().text();
    if (g_stop) break;
    screen.draw(view.lines(gone + "; trying again, Ctrl-C ends"));
    ::usleep(500'000);
  }
  return 0;
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
  fmt::print("{}", window_line(row));
}

int watch_lines(const std::string& socket, const WatchSettings& settings) {
  auto connection = Connection::open(socket);
  const std::string stream = settings.samples ? "sample" : "window";
  auto subscribed = connection
                        ? connection->ask("subscribe", {{"streams", {stream, "event"}}, {"every", settings.every}})
                        : Result<json>(tl::unexpected<Error>(connection.error()));
  if (!subscribed) {
    fmt::print(stderr, "prismctl: {}\n", subscribed.error().text());
    return 1;
  }
  if (!settings.json) fmt::print("{}", window_heading());
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
  stop_on_signal();
  const bool screen = ::isatty(STDOUT_FILENO) && !settings.json && !settings.samples && settings.count == 0;
  return screen ? watch_screen(socket) : watch_lines(socket, settings);
}

}  // namespace prism::prismctl
