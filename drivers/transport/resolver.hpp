// SPDX-License-Identifier: MIT
// Looks up the addresses of a host without waiting.
#pragma once

#include <sys/socket.h>

#include <memory>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "base/result.hpp"
#include "drivers/transport/endpoint.hpp"

namespace prism::transport {

/// An address of a socket.
struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t size = 0;

  const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&storage); }
  sockaddr* get() { return reinterpret_cast<sockaddr*>(&storage); }
  int family() const { return storage.ss_family; }
  /// "192.0.2.7:4001", "[::1]:4001"
  std::string text() const;
  /// "192.0.2.7", "::1"
  std::string host() const;
  /// Compares hosts, not ports; an IPv4 address equals its form within IPv6.
  bool same_host(const SocketAddress& other) const;
};

/// The address in a text that parse_numeric_endpoint() accepts; without a port in the text, its port is not used.
Result<SocketAddress> numeric_address(const std::string& text, int socket_type);

/// Opens a socket that listens at the address, or returns the error number; 0: none.
int open_listener(const SocketAddress& address, int backlog, Descriptor& listener);

/// One look-up. Numeric addresses are ready at once; a name is looked up on a thread of its own, because getaddrinfo(3)
/// may wait for minutes. The object may be destroyed before the thread ends.
class Resolver {
 public:
  /// `socket_type`: SOCK_STREAM or SOCK_DGRAM. `to_bind`: the addresses are of this host.
  Resolver(const Endpoint& endpoint, int socket_type, bool to_bind);

  /// Becomes readable when the result is ready; -1 if it is ready at once.
  int fd() const;
  bool is_ready() const;
  /// At least one address, in the order to try. Requires is_ready(). Errors: HOST: the reason.
  Result<std::vector<SocketAddress>> result() const;

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

}  // namespace prism::transport
