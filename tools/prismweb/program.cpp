// SPDX-License-Identifier: MIT
#include "tools/prismweb/program.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <csignal>
#include <iostream>
#include <string>
#include <utility>

#include "base/notify.hpp"
#include "tools/prismweb/awaiting.hpp"
#include "tools/prismweb/listener.hpp"
#include "tools/prismweb/options.hpp"
#include "tools/prismweb/site.hpp"
#include "tools/prismweb/token_file.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;

int fail(int code, const std::string& what) {
  fmt::print(stderr, "prismweb: {}\n", what);
  return code;
}

Result<std::unique_ptr<Listener>> listen(asio::io_context& io, const Settings& settings) {
  if (!settings.unix_socket.empty()) return Listener::open_unix(io, settings.unix_socket);
  return Listener::open_tcp(io, settings.address, settings.port);
}

void announce(const Settings& settings, const Listener& listener, const std::string& token) {
  if (!settings.unix_socket.empty()) {
    fmt::print("prismweb: serving at {}\n", settings.unix_socket);
  } else {
    const bool v6 = settings.address.find(':') != std::string::npos;
    fmt::print("{}://{}{}{}:{}/{}\n", settings.tls ? "https" : "http", v6 ? "[" : "", settings.address, v6 ? "]" : "",
               listener.port(), token.empty() ? "" : "#token=" + token);
  }
  std::fflush(stdout);
}

// Of a browser of today; keys that cannot be read are told with their path.
Result<std::unique_ptr<asio::ssl::context>> tls_context(const TlsSettings& tls) {
  auto context = std::make_unique<asio::ssl::context>(asio::ssl::context::tls_server);
  context->set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_tlsv1 |
                       asio::ssl::context::no_tlsv1_1);
  boost::system::error_code error;
  context->use_certificate_chain_file(tls.certificate, error);
  if (error) return refuse(tls.certificate, "cannot be used as the certificate: " + error.message());
  context->use_private_key_file(tls.key, asio::ssl::context::pem, error);
  if (error) return refuse(tls.key, "cannot be used as the certificate's key: " + error.message());
  return context;
}

/// What the settings name, read.
struct Loaded {
  std::unique_ptr<asio::ssl::context> tls;
  PasswordHashes passwords;
};

Result<Loaded> load(const Settings& settings) {
  Loaded loaded;
  if (settings.tls) {
    auto tls = tls_context(*settings.tls);
    if (!tls) return tl::unexpected<Error>(tls.error());
    loaded.tls = std::move(*tls);
  }
  if (!settings.passwords.empty()) {
    auto passwords = load_passwords(settings.passwords);
    if (!passwords) return tl::unexpected<Error>(passwords.error());
    loaded.passwords = std::move(*passwords);
  }
  return loaded;
}

int print_hash() {
  std::string password;
  std::getline(std::cin, password);
  const auto hash = hash_password(password);
  if (!hash) return fail(kExitUsage, hash.error().text());
  fmt::print("{}\n", *hash);
  return kExitDone;
}

// Fed by the loop that serves: one that stands still is not.
asio::awaitable<void> feed_watchdog(asio::io_context& io) {
  asio::steady_timer tick(io);
  const std::chrono::microseconds half(watchdog_half_us());
  while (half.count() > 0) {
    notify_watchdog();
    tick.expires_after(half);
    co_await tick.async_wait(kUse);
  }
}

int serve_site(const Settings& settings, Loaded loaded) {
  asio::io_context io(1);
  auto listener = listen(io, settings);
  if (!listener) return fail(kExitFailed, listener.error().text());
  const bool needs_token = settings.unix_socket.empty() && settings.passwords.empty();
  std::string token = needs_token ? kept_token((*listener)->port()) : "";
  if (needs_token && token.empty()) {
    token = make_token();
    if (token.empty()) return fail(kExitFailed, "the system gives no random numbers for a token");
    const auto written = write_token(token, (*listener)->port());
    if (!written) return fail(kExitFailed, written.error().text());
  }
  const auto site = std::make_shared<Site>(io, settings, token, std::move(loaded.passwords));
  site->start();
  asio::co_spawn(io, (*listener)->serve_all(*site, loaded.tls.get()), asio::detached);
  asio::signal_set signals(io, SIGINT, SIGTERM);
  signals.async_wait([&io](const boost::system::error_code&, int) { io.stop(); });
  asio::co_spawn(io, feed_watchdog(io), asio::detached);
  announce(settings, **listener, token);
  notify_ready("serving");
  io.run();
  notify_stopping();
  if (site->finish()) return kExitDone;
  // A thread that waits for such a disk cannot be joined: the process leaves it behind.
  fmt::print(stderr, "prismweb: the disk does not answer: the last minutes will be made again from the log\n");
  std::fflush(stderr);
  ::_exit(kExitFailed);
}

}  // namespace

int run(int argc, char** argv) {
  Options options;
  if (const auto code = parse_options(argc, argv, options)) return *code;
  if (options.hash_password) return print_hash();
  Result<Loaded> loaded = load(options.settings);
  if (!loaded) return fail(kExitConfig, loaded.error().text());
  if (options.check) {
    fmt::print("prismweb: good: {}\n",
               options.settings.unix_socket.empty() ? options.settings.address : options.settings.unix_socket);
    return kExitDone;
  }
  return serve_site(options.settings, std::move(*loaded));
}

}  // namespace prism::prismweb
