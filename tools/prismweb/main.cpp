// SPDX-License-Identifier: MIT
// prismweb: serves a web page and an API for the gyros of a host.
#include <fmt/format.h>
#include <malloc.h>
#include <unistd.h>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <memory>
#include <utility>

#include "base/notify.hpp"
#include "tools/prismweb/router.hpp"
#include "tools/prismweb/server.hpp"
#include "tools/prismweb/settings.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
using client::kUse;

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

// A blocked disk returns no error, so it is polled.
asio::awaitable<void> act_each_second(asio::io_context& io, std::shared_ptr<Router> router, const Server& server) {
  asio::steady_timer tick(io);
  for (bool is_blocked = false;;) {
    tick.expires_after(std::chrono::seconds(1));
    co_await tick.async_wait(kUse);
    server.trim_memory();
    const bool was_blocked = std::exchange(is_blocked, router->disk_busy_for() >= kDiskTimeout);
    if (is_blocked && !was_blocked)
      fmt::print(stderr, "prismweb: the disk has not answered for {} s; minutes and hours are delayed\n",
                 kDiskTimeout.count());
    if (was_blocked && !is_blocked) fmt::print(stderr, "prismweb: the disk answers again\n");
  }
}

void print_address(const Settings& settings, int port, const Access& access) {
  if (!settings.unix_socket.empty()) {
    fmt::print("prismweb: serving at {}\n", settings.unix_socket);
  } else {
    const bool v6 = settings.address.find(':') != std::string::npos;
    fmt::print("http://{}{}{}:{}/#token={}\n", v6 ? "[" : "", settings.address, v6 ? "]" : "", port,
               access.address_token());
  }
  std::fflush(stdout);
}

// SIGHUP prints a new address if the last one was used. The kernel also sends SIGHUP when the terminal of a foreground
// prismweb is closed; then prismweb stops.
asio::awaitable<void> handle_hangup(asio::io_context& io, const Settings& settings, int port,
                                    std::shared_ptr<Router> router) {
  asio::signal_set hangups(io, SIGHUP);
  const bool had_terminal = ::isatty(STDIN_FILENO) == 1;
  for (;;) {
    const auto [error, number] = co_await hangups.async_wait(kUse);
    if (error) co_return;
    if (had_terminal && ::isatty(STDIN_FILENO) != 1) co_return io.stop();
    notify_reloading();
    if (router->access().renew_address_token()) print_address(settings, port, router->access());
    fmt::print(stderr, "prismweb: reloaded\n");
    notify_ready("serving");
  }
}

// Returns the exit code.
int serve(const Settings& settings) {
  // Returns freed responses to the system: by default, glibc raises both thresholds after large ones.
  mallopt(M_MMAP_THRESHOLD, 64 << 10);
  mallopt(M_TRIM_THRESHOLD, 1 << 20);
  asio::io_context io(1);
  const auto failed = [](const Error& error) {
    fmt::print(stderr, "prismweb: {}\n", error.text());
    return kExitFailed;
  };
  const auto server = Server::open(io, settings);
  if (!server) return failed(server.error());
  const int port = (*server)->port();
  Result<Access> access = settings.unix_socket.empty() ? Access::with_token(settings.hosts, settings.address, port)
                                                       : Access(settings.hosts);
  if (!access) return failed(access.error());
  print_address(settings, port, *access);
  const auto router = std::make_shared<Router>(io, settings, std::move(*access));
  asio::signal_set signals(io, SIGINT, SIGTERM);
  signals.async_wait([&io](const boost::system::error_code&, int) { io.stop(); });
  asio::co_spawn(io, handle_hangup(io, settings, port, router), asio::detached);
  asio::co_spawn(io, (*server)->serve(router), asio::detached);
  asio::co_spawn(io, feed_watchdog(io), asio::detached);
  asio::co_spawn(io, act_each_second(io, router, **server), asio::detached);
  io.poll();  // installs the SIGHUP handler before systemd may send one
  notify_ready("serving");
  io.run();
  notify_stopping();
  if (router->finish()) return kExitDone;
  // A thread blocked by the disk cannot be joined.
  fmt::print(stderr, "prismweb: the disk does not respond: the last minutes will be rebuilt from the log\n");
  std::fflush(stderr);
  ::_exit(kExitFailed);
}

}  // namespace
}  // namespace prism::prismweb

int main(int argc, char** argv) {
  using namespace prism::prismweb;
  std::signal(SIGPIPE, SIG_IGN);
  try {
    Settings settings;
    const auto code = parse_options(argc, argv, settings);
    return code ? *code : serve(settings);
  } catch (const std::exception& bug) {
    std::fprintf(stderr, "prismweb: internal error: %s; please report it\n", bug.what());
    return kExitBug;
  }
}
