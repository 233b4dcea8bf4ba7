// SPDX-License-Identifier: MIT
#include "tools/prismctl/screen/watch_screen.hpp"

#include <poll.h>
#include <signal.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/text_number.hpp"
#include "tools/client/connection.hpp"
#include "tools/prismctl/screen/terminal.hpp"
#include "tools/prismctl/screen/view.hpp"
#include "tools/prismctl/words.hpp"

namespace prism::screen {
namespace {

using client::DaemonConnection, prismctl::at;
using nlohmann::json;

constexpr double kStatusEveryS = 1, kRetryS = 1, kDrawEveryS = 1, kLeastBetweenDrawsS = 0.1;

volatile sig_atomic_t g_end = 0, g_stop = 0;

void heed_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { g_end = 1; };
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  ::sigaction(SIGHUP, &action, nullptr);
  action.sa_handler = [](int) { g_stop = 1; };
  ::sigaction(SIGTSTP, &action, nullptr);
  action.sa_handler = [](int) {};
  ::sigaction(SIGWINCH, &action, nullptr);
  ::signal(SIGPIPE, SIG_IGN);
}

double steady_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

std::string utc_now() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return utc_text(std::chrono::duration_cast<std::chrono::seconds>(now).count()).substr(11, 8) + " UTC";
}

/// One connection and its pending requests; never waits for a response.
class Watch {
 public:
  Watch(const std::string& socket, const std::string& axis)
      : socket_(socket), view_(std::filesystem::path(socket).stem().string(), terminal_.utf8()) {
    view_.prefer(axis);
  }

  int run() {
    while (!g_end && !quit_) {
      if (g_stop) stop();
      keep_asking();
      draw();
      wait();
      take_keys();
      take_messages();
    }
    return 0;
  }

 private:
  // Ctrl-Z: the shell uses the terminal until the program continues.
  void stop() {
    g_stop = 0;
    terminal_.leave();
    ::raise(SIGSTOP);
    terminal_.enter();
    changed_ = true;
  }

  void lose(const Error& error) {
    connection_.reset();
    status_id_ = history_id_ = events_id_ = 0;
    next_try_s_ = steady_s() + kRetryS;
    view_.gone(error.text());
    changed_ = true;
  }

  // Requests the status again only after a response, so that a blocked prismd gets one request.
  void keep_asking() {
    if (!connection_) {
      if (steady_s() < next_try_s_) return;
      auto opened = DaemonConnection::open(socket_);
      if (!opened) return lose(opened.error());
      connection_.emplace(std::move(*opened));
      next_status_s_ = 0;
      asked_all_ = false;
    }
    if (status_id_ != 0 || steady_s() < next_status_s_) return;
    next_status_s_ = steady_s() + kStatusEveryS;
    send("status", nullptr, status_id_);
    if (asked_all_) return;
    asked_all_ = true;
    int ignored = 0;
    send("history", {{"seconds", 3600}}, history_id_);
    send("events", {{"count", 16}}, events_id_);
    send("subscribe", {{"streams", {"window", "event"}}}, ignored);
  }

  void send(const char* method, const json& params, int& id) {
    if (!connection_) return;
    const auto sent = connection_->send(method, params);
    if (!sent) return lose(sent.error());
    id = *sent;
  }

  void draw() {
    const double now = steady_s();
    if (now - drawn_s_ < (changed_ ? kLeastBetweenDrawsS : kDrawEveryS)) return;
    drawn_s_ = now;
    changed_ = false;
    terminal_.draw(view_.lines(terminal_.size(), now, utc_now()));
  }

  void wait() {
    double until = drawn_s_ + (changed_ ? kLeastBetweenDrawsS : kDrawEveryS);
    if (!connection_) until = std::min(until, next_try_s_);
    if (connection_ && status_id_ == 0) until = std::min(until, next_status_s_);
    const int timeout_ms = std::max(static_cast<int>((until - steady_s()) * 1e3) + 1, 0);
    std::array<pollfd, 2> waits = {
        {{terminal_.keyboard(), POLLIN, 0}, {connection_ ? connection_->fd() : -1, POLLIN, 0}}};
    // A resize of the terminal interrupts: draw at once.
    if (::poll(waits.data(), waits.size(), timeout_ms) < 0) changed_ = true, drawn_s_ = 0;
  }

  void take_keys() {
    while (const auto key = terminal_.key()) {
      quit_ = quit_ || *key == 'q';
      view_.key(*key, steady_s());
      changed_ = true, drawn_s_ = 0;
    }
  }

  void take_messages() {
    while (connection_) {
      const auto message = connection_->next(0);
      if (!message) return lose(message.error());
      if (!*message) return;
      take(**message);
    }
  }

  void take(const json& message) {
    const json& method = at(message, "method");
    const json& params = at(message, "params");
    if (method == "window") view_.window(params, steady_s());
    if (method == "event") {
      view_.event(params);
      next_status_s_ = 0;  // an event may change the status
    }
    if (at(message, "id") == status_id_ && status_id_ != 0) {
      status_id_ = 0;
      const auto status = client::response_of("status", message);
      if (!status) return lose(status.error().error);
      view_.status(*status, steady_s());
    }
    if (at(message, "id") == events_id_ && events_id_ != 0) {
      events_id_ = 0;
      view_.events(at(message, "result"));
    }
    if (at(message, "id") == history_id_ && history_id_ != 0) {
      history_id_ = 0;
      view_.history(at(message, "result"), steady_s());
    }
    changed_ = true;
  }

  std::string socket_;
  Terminal terminal_;
  View view_;
  std::optional<DaemonConnection> connection_;
  int status_id_ = 0, history_id_ = 0, events_id_ = 0;  ///< 0: no request is pending
  bool quit_ = false, changed_ = true, asked_all_ = false;
  double next_try_s_ = 0, next_status_s_ = 0, drawn_s_ = 0;
};

}  // namespace

int watch_screen(const std::string& socket, const std::string& axis) {
  heed_signals();
  return Watch(socket, axis).run();
}

}  // namespace prism::screen
