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

class Site;
struct Connection;
using UpgradeRequest = boost::beast::http::request<boost::beast::http::empty_body>;

/// Serves the client until it leaves, is not let in (closed with 1008, or 1013 where there is no room), or takes
/// nothing for 30 s. `protocol`: the one of Foxglove's that was agreed on; empty: our own.
boost::asio::awaitable<void> run_websocket(PlainStream stream, const UpgradeRequest& request, Site& site,
                                           const std::string& protocol, std::shared_ptr<Connection> connection);
boost::asio::awaitable<void> run_websocket(TlsStream stream, const UpgradeRequest& request, Site& site,
                                           const std::string& protocol, std::shared_ptr<Connection> connection);

}  // namespace prism::prismweb
