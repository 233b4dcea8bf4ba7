// SPDX-License-Identifier: MIT
#include "drivers/transport/tcp_line.hpp"

#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>
#include <utility>

#include "base/file.hpp"
#include "drivers/transport/endpoint.hpp"
#include "drivers/transport/resolver.hpp"
#include "drivers/transport/wait_set.hpp"

namespace prism::transport {
namespace {

constexpr std::chrono::milliseconds kConnectWithin{5000};
constexpr int kKeepIdleS = 10, kKeepEveryS = 5, kKeepProbes = 2, kUnansweredMs = 20'000;
constexpr int kBacklog = 4;

std::string why_not_connected(int error) {
  switch (error) {
    case ECONNREFUSED:
      return "connection refused: no program listens there";
    case ETIMEDOUT:
      return "no answer";
    case EPERM:
    case EACCES:
      return "not permitted: IPAddressAllow= of the unit, or a firewall";
    default:
      return std::strerror(error);
  }
}

void set_option(int fd, int level, int name, int value) { ::setsockopt(fd, level, name, &value, sizeof value); }

void watch_peer(int fd) {
  set_option(fd, IPPROTO_TCP, TCP_NODELAY, 1);
  set_option(fd, SOL_SOCKET, SO_KEEPALIVE, 1);
  set_option(fd, IPPROTO_TCP, TCP_KEEPIDLE, kKeepIdleS);
  set_option(fd, IPPROTO_TCP, TCP_KEEPINTVL, kKeepEveryS);
  set_option(fd, IPPROTO_TCP, TCP_KEEPCNT, kKeepProbes);
  set_option(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, kUnansweredMs);
}

// On this host, a connection to a port that no program listens on can connect to itself: the kernel chose the same port
// for this end.
bool is_own_end(int fd) {
  SocketAddress here, there;
  here.size = there.size = sizeof here.storage;
  return ::getsockname(fd, here.get(), &here.size) == 0 && ::getpeername(fd, there.get(), &there.size) == 0 &&
         here.size == there.size && std::memcmp(&here.storage, &there.storage, here.size) == 0;
}

class TcpLine : public Transport {
 public:
  TcpLine(std::string name, const Endpoint& endpoint, bool listens, std::optional<SocketAddress> from)
      : name_(std::move(name)), listens_(listens), from_(from), resolver_(endpoint, SOCK_STREAM, listens) {
    if (resolver_.fd() >= 0) waits_.wait_for(resolver_.fd(), EPOLLIN);
    waits_.wait_for(deadline_.fd(), EPOLLIN);
    progress_ = fmt::format("looking up {}", endpoint.host);
  }

  int fd() const override { return waits_.fd(); }
  std::string opening() const override { return connected_ ? "" : progress_; }
  std::string peer() const override { return peer_; }
  std::string turned_away() override { return std::exchange(turned_away_, {}); }

  Received read(std::span<std::uint8_t> buffer) override {
    if (!connected_) {
      const auto step = proceed();
      if (!step) return {.kind = Received::Kind::kLost, .why = step.error()};
      return {};
    }
    const ssize_t size = ::recv(socket_.get(), buffer.data(), buffer.size(), 0);
    if (size > 0) return {Received::Kind::kData, static_cast<std::size_t>(size)};
    if (size == 0) return {.kind = Received::Kind::kLost, .why = "the other end closed the connection"};
    if (errno != EAGAIN && errno != EINTR) return {.kind = Received::Kind::kLost, .why = std::strerror(errno)};
    if (listener_.get() >= 0) {
      SocketAddress other;
      if (accept_from(other).get() >= 0) turned_away_ = other.host();
    }
    return {};
  }

  Result<std::size_t> write(std::span<const std::uint8_t> bytes) override {
    const ssize_t size = ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (size >= 0) return static_cast<std::size_t>(size);
    if (errno == EAGAIN || errno == EINTR) return 0;
    return make_error(name_, std::string("cannot write: ") + std::strerror(errno));
  }

  bool has_unread() const override {
    int bytes = 0;
    return connected_ && ::ioctl(socket_.get(), FIONREAD, &bytes) == 0 && bytes > 0;
  }

  using Step = tl::expected<void, std::string>;

  /// The next step to a connection, if it is possible now. Errors: all addresses failed, for this reason.
  Step proceed() {
    if (!resolver_.is_ready()) return {};
    if (!addresses_) {
      if (const auto found = resolver_.result(); found) {
        addresses_ = *found;
      } else {
        return tl::unexpected<std::string>(found.error().text());
      }
      return try_next();
    }
    return listens_ ? accept_peer() : check_connection();
  }

 private:
  Step try_next() {
    while (next_ < addresses_->size()) {
      const SocketAddress& address = (*addresses_)[next_++];
      const int error = listens_ ? listen_at(address) : connect_to(address);
      if (error == 0) return {};
      failed(address, error);
    }
    return tl::unexpected<std::string>(failure_);
  }

  void failed(const SocketAddress& address, int error) {
    failure_ = address.text() + ": " + (listens_ ? std::strerror(error) : why_not_connected(error));
  }

  int connect_to(const SocketAddress& address) {
    socket_.reset(::socket(address.family(), SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    if (socket_.get() < 0) return errno;
    progress_ = "connecting to " + address.text();
    if (::connect(socket_.get(), address.get(), address.size) != 0 && errno != EINPROGRESS) return errno;
    waits_.wait_for(socket_.get(), EPOLLOUT);
    deadline_.set(kConnectWithin);
    return 0;
  }

  Step check_connection() {
    pollfd writable{socket_.get(), POLLOUT, 0};
    const bool late = deadline_.passed();
    if (::poll(&writable, 1, 0) <= 0) {
      if (!late) return {};
      failure_ =
          fmt::format("{}: no answer within {} s", (*addresses_)[next_ - 1].text(), kConnectWithin.count() / 1000);
      return try_next();
    }
    int error = 0;
    socklen_t size = sizeof error;
    ::getsockopt(socket_.get(), SOL_SOCKET, SO_ERROR, &error, &size);
    if (error == 0 && is_own_end(socket_.get())) error = ECONNREFUSED;
    if (error == 0) return connected(), Step();
    failed((*addresses_)[next_ - 1], error);
    return try_next();
  }

  int listen_at(const SocketAddress& address) {
    if (const int error = open_listener(address, kBacklog, listener_); error != 0) return error;
    waits_.wait_for(listener_.get(), EPOLLIN);
    progress_ = "waiting for a connection to " + address.text();
    return 0;
  }

  Step accept_peer() {
    SocketAddress address;
    Descriptor peer = accept_from(address);
    const bool none = errno == EAGAIN || errno == EINTR || errno == ECONNABORTED;
    if (peer.get() < 0 && !none) return tl::unexpected<std::string>(std::strerror(errno));  // no descriptor is left
    if (peer.get() < 0) return {};
    if (from_ && !from_->same_host(address)) {
      turned_away_ = address.host();
      return {};
    }
    peer_ = address.host();
    socket_ = std::move(peer);
    return connected(), Step();
  }

  void connected() {
    connected_ = true;
    deadline_.set(std::chrono::milliseconds(0));
    watch_peer(socket_.get());
    waits_.wait_for(socket_.get(), EPOLLIN);
  }

  Descriptor accept_from(SocketAddress& address) {
    address.size = sizeof address.storage;
    return Descriptor(::accept4(listener_.get(), address.get(), &address.size, SOCK_NONBLOCK | SOCK_CLOEXEC));
  }

  const std::string name_;
  const bool listens_;
  const std::optional<SocketAddress> from_;
  WaitSet waits_;
  Deadline deadline_;
  Resolver resolver_;
  std::optional<std::vector<SocketAddress>> addresses_;
  std::size_t next_ = 0;  ///< the next of the addresses to try
  Descriptor listener_, socket_;
  bool connected_ = false;
  std::string progress_, failure_, peer_, turned_away_;
};

}  // namespace

Network read_tcp_line(const Section& section) {
  Network network;
  network.listens = section.has("listen");
  const char* const key = network.listens ? "listen" : "address";
  if (network.listens && section.has("address"))
    section.fail("address", "given together with \"listen\"; expected one of them");
  network.address = section.text(key);
  if (const auto endpoint = parse_endpoint(network.address); !endpoint) section.fail(key, endpoint.error());
  if (!section.has("from")) return network;
  network.from = section.text("from");
  if (!network.listens) section.fail("from", "given with \"address\"; expected \"listen\"");
  if (const auto from = parse_numeric_endpoint(network.from); !from) {
    section.fail("from", from.error());
  } else if (!from->port.empty()) {
    section.fail("from", "has a port, which a peer that connects chooses itself; expected an address");
  }
  return network;
}

Result<std::unique_ptr<Transport>> open_tcp_line(const Settings& settings) {
  const std::string name = describe_tcp_line(settings);
  const auto endpoint = parse_endpoint(settings.network.address);
  if (!endpoint) return make_error(name, endpoint.error());
  std::optional<SocketAddress> from;
  if (!settings.network.from.empty()) {
    const auto found = numeric_address(settings.network.from, SOCK_STREAM);
    if (!found) return tl::unexpected<Error>(found.error());
    from = *found;
  }
  auto line = std::make_unique<TcpLine>(name, *endpoint, settings.network.listens, from);
  if (line->fd() < 0) return make_error(name, std::strerror(errno));
  if (const auto begun = line->proceed(); !begun) return make_error(name, begun.error());
  return line;
}

std::string describe_tcp_line(const Settings& settings) {
  return (settings.network.listens ? "tcp listening on " : "tcp ") + settings.network.address;
}

bool tcp_line_is_present(const Settings& settings) { return !settings.network.listens; }

}  // namespace prism::transport
