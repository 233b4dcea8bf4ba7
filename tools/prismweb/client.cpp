// SPDX-License-Identifier: MIT
#include "tools/prismweb/client.hpp"

#include "tools/prismweb/web_server.hpp"

namespace prism::prismweb {

Client::Client(WebServer& server, Channel& channel)
    : server_(server), weak_server_(server.weak_from_this()), channel_(channel) {}

Client::~Client() {
  const auto server = weak_server_.lock();
  if (!server) return;
  server->remove(this);
  for (const auto& proxy : server->instances().all()) proxy->subscribe(this, {});
}

void Client::add_to_server() { server_.add(this); }

}  // namespace prism::prismweb
