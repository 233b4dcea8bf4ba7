// SPDX-License-Identifier: MIT
// The running prismweb: it serves until SIGINT or SIGTERM, and reads its files of secrets again at SIGHUP.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <memory>
#include <string>

#include "base/result.hpp"
#include "tools/prismweb/passwords.hpp"
#include "tools/prismweb/settings.hpp"
#include "tools/prismweb/tls.hpp"

namespace prism::prismweb {

class Listener;
class WebServer;

/// The files that the settings name.
struct SecretFiles {
  Tls tls;  ///< its context is null without TLS
  PasswordHashes passwords;
};

/// Reads them all; prints a warning about the certificate, if there is one. Errors: of the first file that is refused.
Result<SecretFiles> load_secret_files(const Settings& settings);

class Service {
 public:
  explicit Service(const Settings& settings);
  ~Service();

  /// Serves. Returns the exit code.
  int run(SecretFiles files);

 private:
  Result<void> open(SecretFiles files);
  boost::asio::awaitable<void> reload_on_hangup();
  void reload();
  void print_address();

  const Settings settings_;
  boost::asio::io_context io_{1};
  std::unique_ptr<Listener> listener_;
  std::shared_ptr<WebServer> server_;
};

}  // namespace prism::prismweb
