// SPDX-License-Identifier: MIT
// Lines through a network: their addresses as a configuration has them (HOST:PORT), looking them up, and both types.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <chrono>
#include <cstdint>
#include <future>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "base/result.hpp"
#include "drivers/transport/transport.hpp"

namespace prism::transport {

struct Endpoint {
  std::string host;        ///< name, IPv4 or IPv6 address without brackets
  std::uint16_t port = 0;  ///< 0: none
  bool operator==(const Endpoint&) const = default;
};

/// "device-server:4001", "192.0.2.7:4001" or "[2001:db8::7]:4001". The error names the missing part: found …, expected
/// ….
tl::expected<Endpoint, std::string> parse_endpoint(std::string_view text);

/// An IPv4 or IPv6 address, with or without a port: "192.0.2.7", "192.0.2.7:4001", "::1", "[::1]:4001". Names are
/// errors.
tl::expected<Endpoint, std::string> parse_numeric_endpoint(std::string_view text);

// Looks up the addresses of a host without waiting.

inline constexpr std::chrono::milliseconds kLookAgain{20};

using Address = boost::asio::ip::address;

/// At least one address, in the order to try. Errors: HOST: the reason.
using Found = Result<std::vector<Address>>;

/// A numeric address is found at once. A name is looked up on a thread of its own, because getaddrinfo(3) may wait for
/// minutes; the future may be destroyed before that thread ends.
std::future<Found> look_up(const std::string& host);

/// Returns true if get() does not wait. Call it every kLookAgain.
bool is_found(const std::future<Found>& look_up);

/// The address that identifies a host: an IPv4 address within IPv6 becomes IPv4; the interface of an IPv6 address is
/// dropped.
Address host_of(const Address& address);

/// "192.0.2.7:4001", "[::1]:4001"
std::string text_of(const Address& address, std::uint16_t port);

/// Begins to connect, or to wait for a peer. Tries all addresses of a name in turn, at most 5 s each. A peer that
/// vanished is found by keepalive after 20 s. While a peer is connected, others are turned away.
Result<std::unique_ptr<Transport>> open_tcp_line(boost::asio::io_context& io, const Settings& settings);

/// Receives the datagrams that arrive at the address; ignores those of other hosts than "from". One read returns one
/// datagram. Bytes are sent to the port in "from", else to the sender of the last datagram. A line that does not listen
/// (an output) sends to its address, an IP address, from any free port.
Result<std::unique_ptr<Transport>> open_udp_line(boost::asio::io_context& io, const Settings& settings);

}  // namespace prism::transport
