// SPDX-License-Identifier: MIT
// Access on a loopback address. Programs send a token from a file that only this user can read; browsers open an
// address with a single-use token and get a cookie.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.hpp"
#include "tools/prismweb/access.hpp"
#include "tools/prismweb/http_message.hpp"

namespace prism::prismweb {

class TokenAccess {
 public:
  /// Reads `prismweb-PORT.token` of a previous run from the runtime directory ($RUNTIME_DIRECTORY of systemd, else
  /// $XDG_RUNTIME_DIR, else /tmp), so that programs and open pages continue. Writes a new token unless a valid one
  /// exists that only this user can read. Errors: the file cannot be written.
  static Result<std::unique_ptr<TokenAccess>> open(int port);

  /// True for the token in the file, for programs. Printed addresses never contain it.
  bool is_program_token(std::string_view given) const { return is_secret(given, program_token_); }

  /// Token of the printed address; empty after its use.
  const std::string& address_token() const { return address_token_; }
  /// Makes a new address token if the last one was used; else returns false.
  bool renew_address_token();

  /// True if the request has the program token (Authorization: Bearer), or a page of this server sent it with the
  /// cookie.
  bool is_authenticated(const Request& request) const;

  /// Takes the token of the printed address. Returns the Set-Cookie field; nullopt if the token is wrong or was used.
  std::optional<std::string> begin_session(std::string_view token);

 private:
  TokenAccess(int port, std::string program_token);

  /// The cookie's value is a hash of the program token: it is valid as long as that, and does not reveal it.
  std::string cookie_name_, program_token_, cookie_, address_token_;
};

}  // namespace prism::prismweb
