// SPDX-License-Identifier: MIT
// One connection: requests and their answers, until it becomes a WebSocket or ends.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <memory>

#include "tools/prismweb/stream.hpp"

namespace prism::prismweb {

class WebServer;
struct Connection;

/// Serves until the client leaves, is too slow (10 s for a request, 60 s for the next one) or sends what is no request.
boost::asio::awaitable<void> serve(PlainStream stream, WebServer& server, std::shared_ptr<Connection> connection);
/// The same behind TLS, whose handshake may take 10 s.
boost::asio::awaitable<void> serve(TlsStream stream, WebServer& server, std::shared_ptr<Connection> connection);

}  // namespace prism::prismweb
