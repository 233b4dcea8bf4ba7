// SPDX-License-Identifier: MIT
// Access checks: Host, Origin, token, cookie.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace prism::prismweb {

/// Returns the host of a Host field or of an origin's authority, in lower case and without port: "[::1]:8467" →
/// "[::1]". Returns an empty string if the port or the bracket is invalid.
std::string host_of(std::string_view authority);

/// Names under which browsers may access this server.
class HostList {
 public:
  /// Always contains localhost, 127.0.0.1 and [::1]. `address`: where the server listens.
  HostList(const std::string& address, const std::vector<std::string>& more_names);

  /// True if the Host field has a name of this server. A page under another name that resolves to this address (DNS
  /// rebinding) sends its own name.
  bool allows_host(std::string_view host) const;
  /// True if the Origin field ("http://localhost:8467") has a name of this server or is empty.
  bool allows_origin(std::string_view origin) const;

 private:
  std::vector<std::string> names_;
};

/// True if only this host can reach the address. Errors: not an IP address.
Result<bool> is_loopback(const std::string& address);

/// True if a page of this server sent the request; only then its cookie is accepted. Browsers also send the cookie with
/// requests from pages on other ports of this host. `host`: the Host field. An empty field was not sent.
bool is_own_page(std::string_view origin, std::string_view sec_fetch_site, std::string_view host);

/// Returns the values of a cookie; several if it was set for several paths.
std::vector<std::string_view> cookie_values(std::string_view field, std::string_view name);

/// Returns the token of "Bearer TOKEN", or an empty string for another scheme.
std::string_view bearer_of(std::string_view authorization);

/// Compares in constant time. An empty `secret` never matches.
bool is_secret(std::string_view given, std::string_view secret);

/// Returns 32 random bytes in hex, or an empty string if the system has no random numbers.
std::string make_token();

}  // namespace prism::prismweb
