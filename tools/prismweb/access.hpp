// SPDX-License-Identifier: MIT
// Who may be answered: by Host, by Origin, by token.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace prism::prismweb {

/// The host of a Host field or of an origin's authority, in lower case and without its port: "[::1]:8467" → "[::1]".
/// Empty where it is none.
std::string host_of(std::string_view authority);

/// The names that a browser may know this server by.
class HostList {
 public:
  /// localhost, 127.0.0.1 and [::1] are always among them; `address` is the one that is listened on.
  HostList(const std::string& address, const std::vector<std::string>& further);

  /// Whether a Host field names this server. A page of another name that resolves to this address (rebinding) does not.
  bool allows_host(std::string_view host) const;
  /// Whether an Origin field ("http://localhost:8467") is of this server; an empty one is: no browser sent it.
  bool allows_origin(std::string_view origin) const;

 private:
  std::vector<std::string> names_;
};

/// Whether a text can be an Origin field: SCHEME://, and a host with its port or nothing ("file://").
bool is_origin(std::string_view text);

/// Whether an IP address is of this host alone. Refused where the text is no address.
Result<bool> is_loopback(const std::string& address);

/// The address that limits count: of IPv4 the address, of IPv6 its network of 64 bits, which one client may have whole.
std::string address_key(const boost::asio::ip::address& address);

/// True if a page of this server itself sent the request, which is when its cookie counts. A browser sends the cookie
/// also with requests of pages on other ports of this host. `host` is the Host field; empty fields were not sent.
bool is_own_page(std::string_view origin, std::string_view sec_fetch_site, std::string_view host, bool is_tls);

/// The values that a Cookie field has for a name; several if cookies of several paths have it.
std::vector<std::string_view> cookie_values(std::string_view field, std::string_view name);

/// The token of "Bearer TOKEN"; empty where the field is another.
std::string_view bearer_of(std::string_view authorization);

/// Whether two secrets are the same, in a time that does not tell how much of them is. An empty secret is never right.
bool is_secret(std::string_view given, std::string_view secret);

/// 32 random bytes in hex.
std::string make_token();

}  // namespace prism::prismweb
