// SPDX-License-Identifier: MIT
// `prismctl watch`: live screen on a terminal, else lines or JSON.
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/signal_set.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/host_time.hpp"
#include "base/text_number.hpp"
#include "tools/client/client.hpp"
#include "tools/prismctl/commands.hpp"
#include "tools/prismctl/screen.hpp"
#include "tools/prismctl/views.hpp"
#include "tools/prismctl/words.hpp"

namespace prism::prismctl {
namespace {

namespace asio = boost::asio;
using client::kUse;
using nlohmann::json;

json subscription_of(const WatchSettings& settings) {
  json wanted = {{"streams", {settings.samples ? "sample" : "window", "event"}}, {"every", settings.every}};
  if (!settings.axis.empty()) wanted["axes"] = {settings.axis};
  return wanted;
}

void print_notification(const std::string& method, const json& params, bool as_json, bool several) {
  if (as_json) return print_json(json{{"method", method}, {"params", params}});
  if (method == "event") return print_text("# " + event_line(params));
  if (method == "lost")
    return print_text(fmt::format("# {} rows lost: this client read too slowly\n", count_text(at(params, "rows"))));
  print_text((several ? fmt::format("{:<5}", text_of(at(params, "axis"), "")) : "") + window_line(params));
}

asio::awaitable<Result<void>> watch_lines(client::Client& client, const WatchSettings& settings) {
  const auto status = co_await client.ask("status");  // the heading depends on the number of axes
  if (!status) co_return tl::unexpected<Error>(status.error().error);
  const bool several = settings.axis.empty() && at(*status, "axes").size() > 1;
  if (!settings.json) fmt::print("{}{}", several ? "axis " : "", window_heading());
  const auto executor = co_await asio::this_coro::executor;
  asio::signal_set end(executor, SIGINT, SIGTERM);
  std::uint64_t rows = 0;
  bool done = false;
  client.on_notification = [&](std::string_view line) {
    const json message = parse_json_line(line).value_or(json());
    const std::string method = text_member(message, "method");
    if (done || method.empty()) return;
    print_notification(method, at(message, "params"), settings.json, several);
    if (method == (settings.samples ? "sample" : "window")) ++rows;
    done = std::fflush(stdout) != 0 || (rows > 0 && rows == settings.count);  // or the reader closed the pipe
    if (done) end.cancel();
  };
  const auto subscribed = co_await client.ask("subscribe", subscription_of(settings));
  if (subscribed && !done) co_await end.async_wait(kUse);
  client.on_notification = nullptr;
  if (!subscribed) co_return tl::unexpected<Error>(subscribed.error().error);
  co_return Result<void>();
}

bool is_set(const char* name) {
  const char* const value = std::getenv(name);
  return value != nullptr && *value != '\0';
}

Size terminal_size() {
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row == 0 || size.ws_col == 0) return {};
  return {size.ws_col, size.ws_row};
}

// Plain VT sequences, which all current terminals, multiplexers and the Linux console support.
void print_screen(const std::vector<Line>& lines) {
  constexpr std::array<const char*, 6> kColours = {"", "\033[2m", "\033[32m", "\033[33m", "\033[1;31m", "\033[36m"};
  const bool colour = !is_set("NO_COLOR");  // https://no-color.org
  std::string text = "\033[H";
  for (const Line& line : lines)
    text += (colour ? kColours[static_cast<std::size_t>(line.colour)] : "") + line.text + "\033[0m\033[K\r\n";
  text.resize(text.size() - 2);
  fmt::print("{}\033[J", text);
  std::fflush(stdout);
}

/// The live screen. Keys are read without a line end and not shown; Ctrl-C and Ctrl-Z stay signals. After the end the
/// last values remain on the terminal.
class ScreenWatch {
 public:
  ScreenWatch(const std::string& socket, const WatchSettings& settings)
      : client_(io_, socket), settings_(settings), screen_(client_.name()) {
    client_.on_notification = [this](std::string_view line) {
      const json message = parse_json_line(line).value_or(json());
      const std::string method = text_member(message, "method");
      if (method == "window") screen_.row(at(message, "params"));
      if (method == "event") screen_.event(at(message, "params"));
    };
    client_.on_end = [this](client::State, const std::string& reason) {
      screen_.gone(Error{client_.socket(), reason}.text());
    };
    termios keys = before_;
    keys.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    keys.c_cc[VMIN] = keys.c_cc[VTIME] = 0;
    if (has_keys_) ::tcsetattr(STDIN_FILENO, TCSANOW, &keys);
  }
  ~ScreenWatch() {
    if (has_keys_) ::tcsetattr(STDIN_FILENO, TCSANOW, &before_);
  }
  ScreenWatch(const ScreenWatch&) = delete;
  ScreenWatch& operator=(const ScreenWatch&) = delete;

  Result<void> run() {
    asio::co_spawn(io_, client_.run([this] { return ask(); }, true), asio::detached);
    asio::co_spawn(io_, draw(), asio::detached);
    asio::signal_set signals(io_, SIGINT, SIGTERM, SIGHUP);
    signals.async_wait([this](boost::system::error_code, int) { io_.stop(); });
    io_.run();
    fmt::print("\n");
    return result_;
  }

 private:
  static double steady_s() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }

  // The rows of the last hour and the last events; the status each second.
  asio::awaitable<std::string> ask() {
    asio::steady_timer second(io_);
    for (bool first = true;; first = false) {
      second.expires_after(std::chrono::seconds(1));
      auto status = co_await client_.ask("status");
      if (!status) co_return status.error().error.what;
      result_ = choose_axis(*status, settings_.axis);
      if (!result_) io_.stop();
      screen_.status(std::move(*status), steady_s());
      if (first) {
        co_await client_.ask("subscribe", subscription_of(settings_));
        json wanted = {{"seconds", 3600}};
        const auto history = co_await client_.ask("history", wanted);
        for (const json& axis : history ? at(*history, "axes") : json()) {
          for (const json& row : axis) screen_.row(row);
        }
        wanted = {{"count", 16}};
        const auto events = co_await client_.ask("events", wanted);
        for (const json& event : events ? *events : json()) screen_.event(event);
      }
      co_await second.async_wait(kUse);
    }
  }

  // Each second, and after a key.
  asio::awaitable<void> draw() {
    constexpr int kTicks = 10;
    asio::steady_timer tick(io_);
    for (int ticks = 0;; ++ticks) {
      char key = '\0';
      if (has_keys_ && ::read(STDIN_FILENO, &key, 1) != 1) key = '\0';
      if (key == 'q') co_return io_.stop();
      screen_.key(key);
      if (key != '\0' || ticks % kTicks == 0) {
        const std::string utc = utc_text(host_time_ns() / 1'000'000'000).substr(11, 8) + " UTC";
        print_screen(screen_.lines(terminal_size(), steady_s(), utc));
      }
      tick.expires_after(std::chrono::milliseconds(1000 / kTicks));
      co_await tick.async_wait(kUse);
    }
  }

  asio::io_context io_;
  client::Client client_;
  const WatchSettings& settings_;
  termios before_{};
  const bool has_keys_ = ::tcgetattr(STDIN_FILENO, &before_) == 0;
  Screen screen_;
  Result<void> result_;
};

}  // namespace

int watch(const std::string& socket, const WatchSettings& settings) {
  ::signal(SIGPIPE, SIG_IGN);
  const bool terminal =
      ::isatty(STDOUT_FILENO) != 0 && is_set("TERM") && std::string_view(std::getenv("TERM")) != "dumb";
  const client::Work lines = [&](client::Client& client) { return watch_lines(client, settings); };
  const auto done = terminal && !settings.json && !settings.samples && settings.count == 0
                        ? ScreenWatch(socket, settings).run()
                        : client::connected(socket, lines);
  return done ? 0 : fail(done.error());
}

}  // namespace prism::prismctl
