// SPDX-License-Identifier: MIT
#include "drivers/transport/resolver.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <thread>
#include <utility>

#include "base/file.hpp"

namespace prism::transport {
namespace {

using Addresses = std::vector<SocketAddress>;

struct FreeAddresses {
  void operator()(addrinfo* list) const { ::freeaddrinfo(list); }
};

std::string why_not_found(int error) {
  switch (error) {
    case EAI_NONAME:
    case EAI_NODATA:
      return "no host of this name found";
    case EAI_AGAIN:
      return "the name server does not answer";
    case EAI_SYSTEM:
      return std::string("cannot be looked up: ") + std::strerror(errno);
    default:
      return std::string("cannot be looked up: ") + ::gai_strerror(error);
  }
}

// `error`: of getaddrinfo, also for a caller that tries something else.
Result<Addresses> look_up(const Endpoint& endpoint, int socket_type, int flags, int& error) {
  addrinfo hints{};
  hints.ai_socktype = socket_type;
  hints.ai_flags = flags | AI_NUMERICSERV;
  addrinfo* raw = nullptr;
  error = ::getaddrinfo(endpoint.host.c_str(), endpoint.port.c_str(), &hints, &raw);
  if (error != 0) return make_error(endpoint.host, why_not_found(error));
  const std::unique_ptr<addrinfo, FreeAddresses> list(raw);
  Addresses addresses;
  for (const addrinfo* one = list.get(); one; one = one->ai_next) {
    SocketAddress& address = addresses.emplace_back();
    address.size = one->ai_addrlen;
    std::memcpy(&address.storage, one->ai_addr, one->ai_addrlen);
  }
  return addresses;
}

// The host as 16 bytes: IPv4 addresses in the form ::ffff:a.b.c.d.
in6_addr host_of(const SocketAddress& address) {
  if (address.family() == AF_INET6) return reinterpret_cast<const sockaddr_in6*>(&address.storage)->sin6_addr;
  in6_addr mapped{};
  mapped.s6_addr[10] = mapped.s6_addr[11] = 0xFF;
  std::memcpy(mapped.s6_addr + 12, &reinterpret_cast<const sockaddr_in*>(&address.storage)->sin_addr, 4);
  return mapped;
}

}  // namespace

std::string SocketAddress::text() const {
  char host[NI_MAXHOST] = "", port[NI_MAXSERV] = "";
  if (::getnameinfo(get(), size, host, sizeof host, port, sizeof port, NI_NUMERICHOST | NI_NUMERICSERV) != 0)
    return "an unknown address";
  return family() == AF_INET6 ? fmt::format("[{}]:{}", host, port) : fmt::format("{}:{}", host, port);
}

std::string SocketAddress::host() const {
  char host[NI_MAXHOST] = "";
  return ::getnameinfo(get(), size, host, sizeof host, nullptr, 0, NI_NUMERICHOST) == 0 ? host : "an unknown address";
}

bool SocketAddress::same_host(const SocketAddress& other) const {
  const in6_addr one = host_of(*this), two = host_of(other);
  return std::memcmp(&one, &two, sizeof one) == 0;
}

int open_listener(const SocketAddress& address, int backlog, Descriptor& listener) {
  listener.reset(::socket(address.family(), SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (listener.get() < 0) return errno;
  const int yes = 1;
  ::setsockopt(listener.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  const bool listens =
      ::bind(listener.get(), address.get(), address.size) == 0 && ::listen(listener.get(), backlog) == 0;
  return listens ? 0 : errno;
}

struct Resolver::Shared {
  Descriptor done{-1};
  std::atomic<bool> ready{false};
  Result<Addresses> result;  // written before `ready`
};

Resolver::Resolver(const Endpoint& endpoint, int socket_type, bool to_bind) : shared_(std::make_shared<Shared>()) {
  const int flags = to_bind ? AI_PASSIVE : 0;
  int error = 0;
  shared_->result = look_up(endpoint, socket_type, flags | AI_NUMERICHOST, error);
  shared_->ready = error != EAI_NONAME;
  if (shared_->ready) return;
  shared_->done.reset(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (shared_->done.get() < 0) {
    shared_->result = make_error(endpoint.host, std::string("cannot be looked up: ") + std::strerror(errno));
    shared_->ready = true;
    return;
  }
  const auto find = [shared = shared_, endpoint, socket_type, flags] {
    int unused = 0;
    shared->result = look_up(endpoint, socket_type, flags, unused);
    shared->ready = true;
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(shared->done.get(), &one, sizeof one);
  };
  try {
    std::thread(find).detach();
  } catch (const std::system_error& no_thread) {
    shared_->result = make_error(endpoint.host, std::string("cannot be looked up: ") + no_thread.what());
    shared_->ready = true;
  }
}

int Resolver::fd() const { return shared_->done.get(); }
bool Resolver::is_ready() const { return shared_->ready; }
Result<std::vector<SocketAddress>> Resolver::result() const { return shared_->result; }

Result<SocketAddress> numeric_address(const std::string& text, int socket_type) {
  auto endpoint = parse_numeric_endpoint(text);
  if (!endpoint) return make_error(text, endpoint.error());
  if (endpoint->port.empty()) endpoint->port = "1";
  const auto found = Resolver(*endpoint, socket_type, false).result();
  if (!found) return tl::unexpected<Error>(found.error());
  return found->front();
}

}  // namespace prism::transport
