// SPDX-License-Identifier: MIT
// Access without passwords, on a loopback address. Programs send the token of a file that only this user can read;
// browsers open an address whose token is good once, and get a cookie for it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.hpp"
#include "tools/prismweb/access.hpp"
#include "tools/prismweb/http_message.hpp"
#include "tools/prismweb/session_list.hpp"

namespace prism::prismweb {

class TokenAccess {
 public:
  /// Reads `prismweb-PORT.token` and `prismweb-PORT.sessions` of an earlier prismweb from the runtime directory
  /// ($RUNTIME_DIRECTORY of systemd, else $XDG_RUNTIME_DIR, else /tmp), so that programs and open pages continue.
  /// Writes a new token if there is none that only this user could read. Errors: the file cannot be written.
  static Result<std::unique_ptr<TokenAccess>> open(int port, bool is_tls);

  /// The token of the file, for programs. It is never part of an address that is printed.
  bool is_program_token(std::string_view given) const { return is_secret(given, program_token_); }

  /// The token of the printed address; empty after it was used.
  const std::string& address_token() const { return address_token_; }
  /// Makes a new one if it was used. Returns false if it was not.
  bool renew_address_token();

  /// True if the request has the program token (Authorization: Bearer), or if a page of this server sent it with the
  /// cookie of a session.
  bool is_authenticated(const Request& request) const;

  /// The Set-Cookie field of a new session for the token of the printed address; nullopt if it is wrong or was used.
  std::optional<std::string> begin_session(std::string_view token);

 private:
  TokenAccess(int port, bool is_tls);

  std::string cookie_name_, sessions_path_;
  bool is_tls_;
  std::string program_token_, address_token_;
  SessionList sessions_;
};

}  // namespace prism::prismweb
