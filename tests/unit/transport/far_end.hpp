// SPDX-License-Identifier: MIT
// Sockets of the other end of a network line, on 127.0.0.1.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstdint>

#include "base/file.hpp"

namespace prism::transport {

/// A socket of the device's or a reader's end.
class Far {
 public:
  explicit Far(int type) : socket_(::socket(AF_INET, type | SOCK_CLOEXEC, 0)) {
    sockaddr_in any = at(0);
    ::bind(fd(), reinterpret_cast<sockaddr*>(&any), sizeof any);
  }
  int fd() const { return socket_.get(); }
  int port() const {
    sockaddr_in own{};
    socklen_t size = sizeof own;
    ::getsockname(fd(), reinterpret_cast<sockaddr*>(&own), &size);
    return ntohs(own.sin_port);
  }
  void listen() const { ::listen(fd(), 1); }
  Descriptor accept() const { return Descriptor(::accept(fd(), nullptr, nullptr)); }
  bool connect(int port) const {
    sockaddr_in to = at(port);
    return ::connect(fd(), reinterpret_cast<sockaddr*>(&to), sizeof to) == 0;
  }
  void close() { socket_.reset(); }

 private:
  static sockaddr_in at(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    return address;
  }
  Descriptor socket_;
};

inline int free_port(int type) { return Far(type).port(); }

}  // namespace prism::transport
