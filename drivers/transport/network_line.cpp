// SPDX-License-Identifier: MIT
#include "drivers/transport/network_line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <cctype>
#include <memory>
#include <system_error>
#include <thread>

#include "base/escape.hpp"
#include "base/text_number.hpp"

namespace prism::transport {
namespace {

namespace ip = boost::asio::ip;
using boost::system::error_code;

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
  error_code is_name;
  ip::make_address(host, is_name);
  return !is_name;
}

std::string why_not_found(const error_code& error) {
  if (error == boost::asio::error::host_not_found) return "no host of this name found";
  if (error == boost::asio::error::host_not_found_try_again) return "the name server does not answer";
  return "cannot be looked up: " + error.message();
}

Found wait_for_name_server(const std::string& host) {
  boost::asio::io_context io;
  error_code error;
  std::vector<Address> addresses;
  for (const auto& entry : ip::tcp::resolver(io).resolve(host, "", error))
    addresses.push_back(entry.endpoint().address());
  if (error) return make_error(host, why_not_found(error));
  return addresses;
}

}  // namespace

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
  const Endpoint endpoint{std::string(host), parse_number<std::uint16_t>(port).value_or(0)};
  if (endpoint.port == 0)
    return wrong(text, fmt::format(" with the port \"{}\", expected 1 to 65535", shortened(port)));
  if (!is_host(host))
    return wrong(text, fmt::format(" with the host \"{}\", expected a name or an address", shortened(host)));
  return endpoint;
}

tl::expected<Endpoint, std::string> parse_numeric_endpoint(std::string_view text) {
  if (text.empty()) return tl::unexpected<std::string>("is empty, expected an IP address");
  if (const Endpoint endpoint{std::string(text)}; is_numeric(endpoint.host)) return endpoint;
  const auto with_port = parse_endpoint(text);
  if (!with_port || !is_numeric(with_port->host)) return wrong(text, ", expected an IP address");
  return with_port;
}

// The thread is detached: Asio's own resolver would wait for it at the end of the program.
std::future<Found> look_up(const std::string& host) {
  const auto found = std::make_shared<std::promise<Found>>();
  auto result = found->get_future();
  error_code is_name;
  if (const Address address = ip::make_address(host, is_name); !is_name) {
    found->set_value(std::vector{address});
    return result;
  }
  try {
    std::thread([host, found] { found->set_value(wait_for_name_server(host)); }).detach();
  } catch (const std::system_error& no_thread) {
    found->set_value(make_error(host, std::string("cannot be looked up: ") + no_thread.what()));
  }
  return result;
}

bool is_found(const std::future<Found>& look_up) {
  return look_up.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

Address host_of(const Address& address) {
  if (address.is_v4()) return address;
  const ip::address_v6 long_form = address.to_v6();
  if (long_form.is_v4_mapped()) return ip::make_address_v4(ip::v4_mapped, long_form);
  return ip::address_v6(long_form.to_bytes());
}

std::string text_of(const Address& address, std::uint16_t port) {
  return address.is_v6() ? fmt::format("[{}]:{}", address.to_string(), port)
                         : fmt::format("{}:{}", address.to_string(), port);
}

}  // namespace prism::transport
