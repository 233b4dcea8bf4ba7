// SPDX-License-Identifier: MIT
// Runs prismweb until SIGINT or SIGTERM; SIGHUP reloads certificate, key and passwords.
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

/// Contents of the certificate, key and password files.
struct SecretFiles {
  Tls tls;  ///< its context is null without TLS
  PasswordHashes passwords;
};

/// Reads the files; prints a warning if the certificate is not valid or expires soon. Errors: of the first bad file.
Result<SecretFiles> load_secret_files(const Settings& settings);

class Service {
 public:
  explicit Service(const Settings& settings);
  ~Service();

  /// Returns the exit code.
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
