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

#include "base/result.hpp"
#include "tools/prismweb/stream.hpp"

namespace prism::prismweb {

class Site;

class Listener {
 public:
  /// `address` as an IP address. Port 0: one that is free.
  static Result<std::unique_ptr<Listener>> open_tcp(boost::asio::io_context& io, const std::string& address,
                                                    std::uint16_t port);
  /// A unix socket of mode 0660, in the place of one that nobody listens at any more.
  static Result<std::unique_ptr<Listener>> open_unix(boost::asio::io_context& io, const std::string& path);
  ~Listener();

  /// Serves each who connects, 128 at once; with TLS where a context is given.
  boost::asio::awaitable<void> serve_all(Site& site, boost::asio::ssl::context* tls);

  std::uint16_t port() const { return port_; }

 private:
  using Protocol = boost::asio::generic::stream_protocol;
  Listener(boost::asio::io_context& io, int fd, int family, std::string path);

  boost::asio::io_context& io_;
  boost::asio::basic_socket_acceptor<Protocol> acceptor_;
  std::string path_;  ///< of a unix socket, which is removed at the end
  std::uint16_t port_ = 0;
};

}  // namespace prism::prismweb
