// SPDX-License-Identifier: MIT
// The unix socket: makes it (or takes systemd's), accepts clients and reads their requests.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <memory>

#include "compensation/result.hpp"
#include "config/config.hpp"
#include "daemon/rpc.hpp"

namespace prism::daemon {

class Server {
 public:
  using Acceptor = boost::asio::local::stream_protocol::acceptor;

  /// `inherited`: a listening socket from systemd, or −1: make one at settings.path. A socket file that nobody answers
  /// on is a leftover and is replaced; one that answers belongs to a running daemon, and this one is refused.
  static Result<std::unique_ptr<Server>> open(boost::asio::io_context& io, const config::SocketSettings& settings,
                                              int inherited, Instance& instance, Rpc& rpc);
  ~Server();

  /// Accepts until the context stops.
  boost::asio::awaitable<void> serve();

 private:
  Server(Acceptor acceptor, config::SocketSettings settings, bool owns_path, Instance& instance, Rpc& rpc);
  boost::asio::awaitable<void> talk(std::shared_ptr<Client> client);
  bool take_lines(const std::shared_ptr<Client>& client, std::string& pending);

  Acceptor acceptor_;
  config::SocketSettings settings_;
  bool owns_path_;
  Instance& instance_;
  Rpc& rpc_;
};

}  // namespace prism::daemon
