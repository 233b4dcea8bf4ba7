// SPDX-License-Identifier: MIT
// Runs prismweb until SIGINT or SIGTERM; SIGHUP prints a new address if the last one was used.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <memory>

#include "base/result.hpp"
#include "tools/prismweb/settings.hpp"

namespace prism::prismweb {

class Listener;
class WebServer;

class Service {
 public:
  explicit Service(const Settings& settings);
  ~Service();

  /// Returns the exit code.
  int run();

 private:
  Result<void> open();
  boost::asio::awaitable<void> handle_hangup();
  void reload();
  void print_address();

  const Settings settings_;
  boost::asio::io_context io_{1};
  std::unique_ptr<Listener> listener_;
  std::shared_ptr<WebServer> server_;
};

}  // namespace prism::prismweb
