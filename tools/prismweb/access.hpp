// SPDX-License-Identifier: MIT
// Access control: Host, Origin, token, cookie.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace prism::prismweb {

/// The fields of an HTTP request that are used; empty: not sent.
struct Request {
  std::string method, target, host, origin, authorization, if_none_match, cookie, sec_fetch_site;
};

struct Admission {
  int status = 0;  ///< HTTP status of the error; 0: admitted
  /// The client sent a valid token or cookie, or none is required.
  bool is_authenticated = false;
};

/// Access by a token on a loopback address; on a Unix socket the mode of its file decides. Programs send a token from a
/// file that only this user can read; browsers open an address with a single-use token and get a cookie.
class Access {
 public:
  /// For a Unix socket. `hosts`: names under which browsers may access this server, besides localhost, 127.0.0.1 and
  /// [::1].
  explicit Access(std::vector<std::string> hosts);
  /// Also allows the address listened on, and requires a token. Reads `prismweb-PORT.token` of a previous run from the
  /// runtime directory ($RUNTIME_DIRECTORY of systemd, else $XDG_RUNTIME_DIR, else /tmp), so that programs and open
  /// pages continue. Writes a new token unless a valid one exists that only this user can read. Errors: the file cannot
  /// be written.
  static Result<Access> with_token(std::vector<std::string> hosts, const std::string& address, int port);

  /// Checks Host, Origin, and token or cookie. `needs_token`: otherwise the request is admitted without.
  Admission admit(const Request& request, bool needs_token) const;

  /// True for the token in the file; always without tokens.
  bool is_program_token(std::string_view given) const;
  bool has_tokens() const { return !program_token_.empty(); }

  /// Token of the printed address; empty after its use.
  const std::string& address_token() const { return address_token_; }
  /// Makes a new address token if the last one was used; else returns false.
  bool renew_address_token();
  /// Takes the token of the printed address. Returns the Set-Cookie field; nullopt if the token is wrong or was used.
  std::optional<std::string> begin_session(const Request& request);

 private:
  bool is_allowed_host(std::string_view authority) const;
  bool is_authenticated(const Request& request) const;

  std::vector<std::string> hosts_;
  /// The cookie's value is a hash of the program token: it is valid as long as that, and does not reveal it.
  std::string cookie_name_, program_token_, cookie_, address_token_;
};

}  // namespace prism::prismweb
