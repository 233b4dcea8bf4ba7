// SPDX-License-Identifier: MIT
// The listening socket, HTTP and WebSocket connections. The only part that uses Beast.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/basic_socket_acceptor.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "base/result.hpp"
#include "base/unix_socket.hpp"
#include "tools/prismweb/router.hpp"
#include "tools/prismweb/settings.hpp"
#include "tools/prismweb/ws_client.hpp"

namespace prism::prismweb {

class Server {
 public:
  /// Listens on the address or the Unix socket (mode 0660) of the settings. Replaces a stale socket that has no
  /// listener.
  static Result<std::unique_ptr<Server>> open(boost::asio::io_context& io, const Settings& settings);

  std::uint16_t port() const { return port_; }
  /// Serves clients, at most 128 at a time, until the context ends. An HTTP client is closed if it is too slow (10 s
  /// for the first request, 60 s for later ones) or sends an invalid request: 431 for a header that is too long, 400
  /// for invalid HTTP, a field that is repeated although access depends on it, Transfer-Encoding, or a body. A
  /// WebSocket client is closed if it is rejected (code 1003 for binary data, 1008 for authentication, 1013 for too
  /// many clients), or does not read for 30 s.
  boost::asio::awaitable<void> serve(std::shared_ptr<Router> router);

 private:
  using Protocol = boost::asio::generic::stream_protocol;
  explicit Server(boost::asio::io_context& io) : io_(io), acceptor_(io) {}
  boost::asio::awaitable<void> trim_memory();

  boost::asio::io_context& io_;
  boost::asio::basic_socket_acceptor<Protocol> acceptor_;
  std::optional<OwnSocketFile> own_;  ///< of the Unix socket
  std::uint16_t port_ = 0;
  /// Shared, because connections left in the context at program exit outlive the server.
  const std::shared_ptr<Connections> connections_ = std::make_shared<Connections>();
};

}  // namespace prism::prismweb
