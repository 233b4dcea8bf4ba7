// SPDX-License-Identifier: MIT
// The unix socket: creates it (or uses systemd's), accepts clients and reads their requests.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/experimental/channel.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <memory>
#include <optional>

#include "base/problems.hpp"
#include "base/result.hpp"
#include "base/unix_socket.hpp"
#include "config/config.hpp"
#include "daemon/socket/rpc.hpp"

namespace prism::socket {

/// Clients of one user (except root and the daemon's own user) use at most three quarters of the connections. If none
/// is free, a client that is idle for kIdle and has no subscription is disconnected to admit a new one. For root and
/// the daemon's own user, any client of another user may be disconnected.
class Server {
 public:
  static constexpr std::chrono::seconds kIdle{60};

  Server(boost::asio::io_context& io, config::SocketSettings settings, Publisher& publisher, Rpc& rpc,
         pipeline::Tell tell, Problems& problems);

  /// `inherited`: a listening socket from systemd; else creates one at settings.path. Replaces a stale socket file.
  /// Errors: another daemon listens on this path.
  Result<void> listen(std::optional<int> inherited);
  /// Accepts until the context stops.
  boost::asio::awaitable<void> serve();
  /// Reports once if the socket's file was removed or replaced, and once if it is back. Call once a second.
  void watch_file();

 private:
  /// Disconnects another client if needed. Returns an error text if the client cannot be admitted, else "".
  std::string admit(const Client& client);
  boost::asio::awaitable<void> talk(std::shared_ptr<Client> client);

  /// One request of any client at a time, first come, first served; the line is read between two of them.
  using Turn = boost::asio::experimental::channel<void(boost::system::error_code)>;

  boost::asio::local::stream_protocol::acceptor acceptor_;
  const config::SocketSettings settings_;
  std::optional<OwnSocketFile> own_;
  Publisher& publisher_;
  const pipeline::Tell tell_;
  Problems& problems_;
  Rpc& rpc_;
  Turn turn_;
  const std::shared_ptr<ClientMemory> memory_ = std::make_shared<ClientMemory>();
};

}  // namespace prism::socket
