// SPDX-License-Identifier: MIT
// An address of a network line as it is written in a configuration: HOST:PORT.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

namespace prism::transport {

struct Endpoint {
  std::string host;  ///< name, IPv4 or IPv6 address without brackets
  std::string port;  ///< 1 to 65535

  /// 0: no port.
  std::uint16_t port_number() const;
  bool operator==(const Endpoint&) const = default;
};

/// "device-server:4001", "192.0.2.7:4001" or "[2001:db8::7]:4001". The error names the missing part: found …, expected
/// ….
tl::expected<Endpoint, std::string> parse_endpoint(std::string_view text);

/// An IPv4 or IPv6 address, with or without a port: "192.0.2.7", "192.0.2.7:4001", "::1", "[::1]:4001". Names are
/// errors.
tl::expected<Endpoint, std::string> parse_numeric_endpoint(std::string_view text);

}  // namespace prism::transport
