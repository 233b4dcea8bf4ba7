// SPDX-License-Identifier: MIT
#include "tools/prismweb/service.hpp"

#include <fmt/format.h>
#include <malloc.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <utility>

#include "base/notify.hpp"
#include "tools/prismweb/awaiting.hpp"
#include "tools/prismweb/listener.hpp"
#include "tools/prismweb/web_server.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;

Result<std::unique_ptr<Listener>> listen(asio::io_context& io, const Settings& settings) {
  if (!settings.unix_socket.empty()) return Listener::open_unix(io, settings.unix_socket);
  return Listener::open_tcp(io, settings.address, settings.port);
}

// Runs in the main loop: if it is blocked, systemd restarts prismweb.
asio::awaitable<void> feed_watchdog(asio::io_context& io) {
  asio::steady_timer tick(io);
  const std::chrono::microseconds half(watchdog_half_us());
  while (half.count() > 0) {
    notify_watchdog();
    tick.expires_after(half);
    co_await tick.async_wait(kUse);
  }
}

}  // namespace

Service::Service(const Settings& settings) : settings_(settings) {}

Service::~Service() = default;

Result<void> Service::open() {
  auto listener = listen(io_, settings_);
  if (!listener) return tl::unexpected<Error>(listener.error());
  listener_ = std::move(*listener);
  std::unique_ptr<TokenAccess> tokens;
  if (settings_.unix_socket.empty()) {
    auto opened = TokenAccess::open(listener_->port());
    if (!opened) return tl::unexpected<Error>(opened.error());
    tokens = std::move(*opened);
  }
  server_ = std::make_shared<WebServer>(io_, settings_, std::move(tokens));
  return {};
}

int Service::run() {
  // Returns freed responses to the system: by default, glibc raises both thresholds after large ones.
  mallopt(M_MMAP_THRESHOLD, 64 << 10);
  mallopt(M_TRIM_THRESHOLD, 1 << 20);
  if (const auto opened = open(); !opened) {
    fmt::print(stderr, "prismweb: {}\n", opened.error().text());
    return kExitFailed;
  }
  asio::signal_set signals(io_, SIGINT, SIGTERM);
  signals.async_wait([this](const boost::system::error_code&, int) { io_.stop(); });
  asio::co_spawn(io_, handle_hangup(), asio::detached);
  server_->start();
  asio::co_spawn(io_, listener_->serve_all(*server_), asio::detached);
  asio::co_spawn(io_, feed_watchdog(io_), asio::detached);
  print_address();
  io_.poll();  // installs the SIGHUP handler before systemd may send one
  notify_ready("serving");
  io_.run();
  notify_stopping();
  if (server_->finish()) return kExitDone;
  // A thread blocked by the disk cannot be joined.
  fmt::print(stderr, "prismweb: the disk does not respond: the last minutes will be rebuilt from the log\n");
  std::fflush(stderr);
  ::_exit(kExitFailed);
}

// The kernel also sends SIGHUP when the terminal of a foreground prismweb is closed; then prismweb stops.
asio::awaitable<void> Service::handle_hangup() {
  asio::signal_set hangups(io_, SIGHUP);
  const bool had_terminal = ::isatty(STDIN_FILENO) == 1;
  for (;;) {
    const auto [error, number] = co_await hangups.async_wait(kUse);
    if (error) co_return;
    if (had_terminal && ::isatty(STDIN_FILENO) != 1) co_return io_.stop();
    reload();
  }
}

void Service::reload() {
  notify_reloading();
  if (server_->tokens() != nullptr && server_->tokens()->renew_address_token()) print_address();
  fmt::print(stderr, "prismweb: reloaded\n");
  notify_ready("serving");
}

void Service::print_address() {
  if (!settings_.unix_socket.empty()) {
    fmt::print("prismweb: serving at {}\n", settings_.unix_socket);
  } else {
    const bool v6 = settings_.address.find(':') != std::string::npos;
    const std::string token = server_->tokens() != nullptr ? "#token=" + server_->tokens()->address_token() : "";
    fmt::print("http://{}{}{}:{}/{}\n", v6 ? "[" : "", settings_.address, v6 ? "]" : "", listener_->port(), token);
  }
  std::fflush(stdout);
}

}  // namespace prism::prismweb
