// SPDX-License-Identifier: MIT
// A WebSocket connection.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <memory>

#include "tools/prismweb/stream.hpp"

namespace prism::prismweb {

class WebServer;
struct Connection;
using UpgradeRequest = boost::beast::http::request<boost::beast::http::empty_body>;

/// Serves the client until it disconnects, is rejected (close code 1003 for binary data, 1008 for authentication, 1013
/// for too many clients), or does not read for 30 s. `is_authenticated`: by the request; if false, the first message
/// must contain the token.
boost::asio::awaitable<void> run_websocket(Stream stream, const UpgradeRequest& request, WebServer& server,
                                           bool is_authenticated, std::shared_ptr<Connection> connection);

}  // namespace prism::prismweb
