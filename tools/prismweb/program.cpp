// SPDX-License-Identifier: MIT
#include "tools/prismweb/program.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <csignal>

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

int serve_site(const Settings& settings) {
  asio::io_context io(1);
  auto listener = listen(io, settings);
  if (!listener) return fail(kExitFailed, listener.error().text());
  const bool needs_token = settings.unix_socket.empty() && settings.passwords.empty();
  const std::string token = needs_token ? make_token() : "";
  std::string token_file;
  if (needs_token) {
    auto written = write_token(token, (*listener)->port());
    if (!written) return fail(kExitFailed, written.error().text());
    token_file = *written;
  }
  const auto site = std::make_shared<Site>(io, settings, token);
  site->start();
  asio::co_spawn(io, (*listener)->serve_all(*site, nullptr), asio::detached);
  asio::signal_set signals(io, SIGINT, SIGTERM);
  signals.async_wait([&io](const boost::system::error_code&, int) { io.stop(); });
  announce(settings, **listener, token);
  io.run();
  if (!token_file.empty()) ::unlink(token_file.c_str());
  return kExitDone;
}

}  // namespace

int run(int argc, char** argv) {
  Options options;
  if (const auto code = parse_options(argc, argv, options)) return *code;
  if (options.check) {
    fmt::print("prismweb: good\n");
    return kExitDone;
  }
  return serve_site(options.settings);
}

}  // namespace prism::prismweb
