// SPDX-License-Identifier: MIT
// The listening socket: TCP or Unix.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/basic_socket_acceptor.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "base/result.hpp"
#include "base/unix_socket.hpp"
#include "tools/prismweb/connection.hpp"
#include "tools/prismweb/stream.hpp"

namespace prism::prismweb {

class WebServer;

class Listener {
 public:
  /// `address`: an IP address. Port 0: any free port.
  static Result<std::unique_ptr<Listener>> open_tcp(boost::asio::io_context& io, const std::string& address,
                                                    std::uint16_t port);
  /// Listens on a Unix socket of mode 0660. Replaces a stale socket that has no listener.
  static Result<std::unique_ptr<Listener>> open_unix(boost::asio::io_context& io, const std::string& path);

  /// Serves clients, at most 128 at a time.
  boost::asio::awaitable<void> serve_all(WebServer& server);

  std::uint16_t port() const { return port_; }

 private:
  using Protocol = boost::asio::generic::stream_protocol;
  Listener(boost::asio::io_context& io, int fd, int family, OwnSocketFile own);
  void serve_socket(Protocol::socket socket, WebServer& server);

  boost::asio::io_context& io_;
  boost::asio::basic_socket_acceptor<Protocol> acceptor_;
  const bool is_unix_;
  const OwnSocketFile own_;
  std::uint16_t port_ = 0;
  /// Shared, because coroutines left in the io_context at program exit outlive the listener.
  std::shared_ptr<ConnectionList> connections_ = std::make_shared<ConnectionList>();
};

}  // namespace prism::prismweb
