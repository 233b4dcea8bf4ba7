// SPDX-License-Identifier: MIT
// Where prismweb listens.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/basic_socket_acceptor.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ssl/context.hpp>
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
  /// `address` as an IP address. Port 0: one that is free.
  static Result<std::unique_ptr<Listener>> open_tcp(boost::asio::io_context& io, const std::string& address,
                                                    std::uint16_t port);
  /// A unix socket of mode 0660, in the place of one that nobody listens at any more.
  static Result<std::unique_ptr<Listener>> open_unix(boost::asio::io_context& io, const std::string& path);

  /// Serves clients, at most 128 at the same time; with TLS if use_tls() was called.
  boost::asio::awaitable<void> serve_all(WebServer& server);

  /// The context of the connections that come from now on.
  void use_tls(std::shared_ptr<boost::asio::ssl::context> tls) { tls_ = std::move(tls); }
  ConnectionList& connections() { return *connections_; }
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
  std::shared_ptr<boost::asio::ssl::context> tls_;
  /// Shared, because what the io_context still holds at the end of the program outlives the listener.
  std::shared_ptr<ConnectionList> connections_ = std::make_shared<ConnectionList>();
};

}  // namespace prism::prismweb
