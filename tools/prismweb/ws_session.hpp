// SPDX-License-Identifier: MIT
// A connection that became a WebSocket.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <memory>
#include <string>

#include "tools/prismweb/stream.hpp"

namespace prism::prismweb {

class WebServer;
struct Connection;
using UpgradeRequest = boost::beast::http::request<boost::beast::http::empty_body>;

/// What is known of a WebSocket before it begins.
struct Upgrade {
  std::string protocol;   ///< Foxglove's, as agreed on; empty: prismweb's own
  bool is_authenticated;  ///< by a field of the request; if not, the first message must have the token
};

/// Serves the client until it leaves, is refused (closed with 1008, or 1013 if there is no room), or reads nothing for
/// 30 s.
boost::asio::awaitable<void> run_websocket(PlainStream stream, const UpgradeRequest& request, WebServer& server,
                                           const Upgrade& upgrade, std::shared_ptr<Connection> connection);
boost::asio::awaitable<void> run_websocket(TlsStream stream, const UpgradeRequest& request, WebServer& server,
                                           const Upgrade& upgrade, std::shared_ptr<Connection> connection);

}  // namespace prism::prismweb
