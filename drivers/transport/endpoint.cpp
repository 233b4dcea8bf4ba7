// SPDX-License-Identifier: MIT
#include "drivers/transport/endpoint.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>

#include <algorithm>
#include <cctype>

#include "base/escape.hpp"
#include "base/text_number.hpp"

namespace prism::transport {
namespace {

constexpr std::size_t kMostHostBytes = 253;  // RFC 1035, section 2.3.4, without the root's dot
constexpr const char* kForm = "expected HOST:PORT";

tl::unexpected<std::string> wrong(std::string_view text, std::string_view why) {
  return tl::unexpected<std::string>(fmt::format("found \"{}\"{}", shortened(text), why));
}

// '%' introduces the interface of a link-local address: fe80::1%eth0.
bool is_host(std::string_view host) {
  return host.size() <= kMostHostBytes && std::all_of(host.begin(), host.end(), [](unsigned char c) {
           return std::isalnum(c) != 0 || c == '.' || c == '-' || c == '_' || c == ':' || c == '%';
         });
}

bool is_numeric(const std::string& host) {
  in6_addr address{};
  const std::string bare = host.substr(0, host.find('%'));
  return ::inet_pton(AF_INET, host.c_str(), &address) == 1 || ::inet_pton(AF_INET6, bare.c_str(), &address) == 1;
}

}  // namespace

std::uint16_t Endpoint::port_number() const { return parse_number<std::uint16_t>(port).value_or(0); }

tl::expected<Endpoint, std::string> parse_endpoint(std::string_view text) {
  if (text.empty()) return tl::unexpected<std::string>(fmt::format("is empty, {}", kForm));
  const bool bracketed = text.front() == '[';
  const std::size_t close = text.find(']');
  if (bracketed && close == std::string_view::npos) return wrong(text, " without \"]\", expected [ADDRESS]:PORT");
  const std::size_t colon = bracketed ? close + 1 : text.rfind(':');
  if (!bracketed && std::count(text.begin(), text.end(), ':') > 1)
    return wrong(text, ", an IPv6 address without brackets; expected [ADDRESS]:PORT");
  const std::string_view host = bracketed ? text.substr(1, close - 1) : text.substr(0, std::min(colon, text.size()));
  if (host.empty()) return wrong(text, fmt::format(" without a host, {}", kForm));
  if (colon >= text.size() || text[colon] != ':' || colon + 1 == text.size())
    return wrong(text, fmt::format(" without a port, {}", kForm));
  const std::string_view port = text.substr(colon + 1);
  Endpoint endpoint{std::string(host), std::string(port)};
  if (endpoint.port_number() == 0)
    return wrong(text, fmt::format(" with the port \"{}\", expected 1 to 65535", shortened(port)));
  if (!is_host(host))
    return wrong(text, fmt::format(" with the host \"{}\", expected a name or an address", shortened(host)));
  return endpoint;
}

tl::expected<Endpoint, std::string> parse_numeric_endpoint(std::string_view text) {
  if (text.empty()) return tl::unexpected<std::string>("is empty, expected an IP address");
  Endpoint endpoint{std::string(text), ""};
  if (!is_numeric(endpoint.host)) {
    const auto with_port = parse_endpoint(text);
    if (!with_port || !is_numeric(with_port->host)) return wrong(text, ", expected an IP address");
    endpoint = *with_port;
  }
  return endpoint;
}

}  // namespace prism::transport
