// SPDX-License-Identifier: MIT
// The unix socket: makes it (or takes systemd's), accepts clients and reads their requests.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <memory>

#include "base/result.hpp"
#include "base/unix_socket.hpp"
#include "config/config.hpp"
#include "daemon/socket/request_queue.hpp"
#include "daemon/socket/rpc.hpp"

namespace prism::socket {

/// A user other than root and the daemon's own has three quarters of the places at most. Who asked for nothing in kIdle
/// and subscribed to nothing gives way to a new client; for root and the daemon's own user anybody does.
class Server {
 public:
  static constexpr std::chrono::seconds kIdle{60};
  using Acceptor = boost::asio::local::stream_protocol::acceptor;

  /// `inherited`: a listening socket from systemd, or −1: make one at settings.path. A socket file that nobody answers
  /// on is a leftover and is replaced; one that answers belongs to a running daemon, and this one is refused.
  static Result<std::unique_ptr<Server>> open(boost::asio::io_context& io, const config::SocketSettings& settings,
                                              int inherited, Publisher& publisher, Rpc& rpc, pipeline::Tell tell);

  /// Accepts until the context stops.
  boost::asio::awaitable<void> serve();

 private:
  Server(Acceptor acceptor, config::SocketSettings settings, OwnSocketFile own, Publisher& publisher, Rpc& rpc,
         pipeline::Tell tell);
  /// Makes room for it where its user may have one more; the refusal, else.
  std::string admit(const Client& client);
  boost::asio::awaitable<void> talk(std::shared_ptr<Client> client);

  Acceptor acceptor_;
  config::SocketSettings settings_;
  const OwnSocketFile own_;
  Publisher& publisher_;
  const pipeline::Tell tell_;
  RequestQueue requests_;
  const std::shared_ptr<ClientMemory> memory_ = std::make_shared<ClientMemory>();
};

}  // namespace prism::socket
