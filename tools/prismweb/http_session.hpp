// SPDX-License-Identifier: MIT
// Serves one HTTP connection until it closes or becomes a WebSocket.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <memory>

#include "tools/prismweb/stream.hpp"

namespace prism::prismweb {

class WebServer;
struct Connection;

/// Returns when the client disconnects, is too slow (10 s for the first request, 60 s for later ones) or sends an
/// invalid request.
boost::asio::awaitable<void> serve(Stream stream, WebServer& server, std::shared_ptr<Connection> connection);

}  // namespace prism::prismweb
