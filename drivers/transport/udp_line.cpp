// SPDX-License-Identifier: MIT
#include "drivers/transport/udp_line.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include "base/file.hpp"
#include "drivers/transport/endpoint.hpp"
#include "drivers/transport/resolver.hpp"
#include "drivers/transport/wait_set.hpp"

namespace prism::transport {
namespace {

constexpr int kReceiveBytes = 1 << 20;  // a second of the fastest gyro, in the kernel

// The datagram does not reach the device: lost, like any other.
bool is_loss(int error) {
  return error == ECONNREFUSED || error == ENETUNREACH || error == EHOSTUNREACH || error == ENETDOWN || error == EPERM;
}

class UdpLine : public Transport {
 public:
  UdpLine(std::string name, const Endpoint& endpoint, std::optional<SocketAddress> from, bool sends)
      : name_(std::move(name)), from_(from), answers_(!sends), resolver_(endpoint, SOCK_DGRAM, true) {
    if (sends) peer_ = from_;
    if (resolver_.fd() >= 0) waits_.wait_for(resolver_.fd(), EPOLLIN);
    progress_ = fmt::format("looking up {}", endpoint.host);
  }

  int fd() const override { return waits_.fd(); }
  std::string opening() const override { return socket_.get() >= 0 ? "" : progress_; }

  Received read(std::span<std::uint8_t> buffer) override {
    if (socket_.get() < 0) {
      if (const auto bound = bind_now(); !bound) return {.kind = Received::Kind::kLost, .why = bound.error()};
      return {};
    }
    SocketAddress sender;
    sender.size = sizeof sender.storage;
    const ssize_t size = ::recvfrom(socket_.get(), buffer.data(), buffer.size(), 0, sender.get(), &sender.size);
    if (size < 0 && (errno == EAGAIN || errno == EINTR || errno == ECONNREFUSED)) return {};
    if (size < 0) return {.kind = Received::Kind::kLost, .why = std::strerror(errno)};
    if (from_ && !from_->same_host(sender)) return {};
    if (answers_) peer_ = sender;
    if (size == 0) return {};
    return {Received::Kind::kData, static_cast<std::size_t>(size)};
  }

  Result<std::size_t> write(std::span<const std::uint8_t> bytes) override {
    if (!peer_) return make_error(name_, "cannot write: no datagram came yet, and \"from\" has no port");
    const ssize_t size = ::sendto(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL, peer_->get(), peer_->size);
    if (size >= 0) return static_cast<std::size_t>(size);
    if (errno == EAGAIN || errno == EINTR) return 0;
    if (is_loss(errno)) return bytes.size();
    return make_error(name_, std::string("cannot write: ") + std::strerror(errno));
  }

  bool has_unread() const override {
    int bytes = 0;
    return socket_.get() >= 0 && ::ioctl(socket_.get(), FIONREAD, &bytes) == 0 && bytes > 0;
  }

  /// Binds if the address is known. Errors: all addresses failed, for this reason.
  tl::expected<void, std::string> bind_now() {
    if (!resolver_.is_ready()) return {};
    const auto found = resolver_.result();
    if (!found) return tl::unexpected<std::string>(found.error().text());
    std::string why;
    for (const SocketAddress& address : *found) {
      Descriptor socket(::socket(address.family(), SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
      if (socket.get() >= 0 && ::bind(socket.get(), address.get(), address.size) == 0) {
        ::setsockopt(socket.get(), SOL_SOCKET, SO_RCVBUF, &kReceiveBytes, sizeof kReceiveBytes);
        socket_ = std::move(socket);
        waits_.wait_for(socket_.get(), EPOLLIN);
        return {};
      }
      why = address.text() + ": " + std::strerror(errno);
    }
    return tl::unexpected<std::string>(why);
  }

 private:
  const std::string name_;
  const std::optional<SocketAddress> from_;
  const bool answers_;  ///< sends to the sender of the last datagram
  WaitSet waits_;
  Resolver resolver_;
  std::optional<SocketAddress> peer_;
  Descriptor socket_;
  std::string progress_;
};

}  // namespace

Network read_udp_line(const Section& section) {
  Network network;
  network.listens = true;
  network.address = section.text("listen");
  if (const auto endpoint = parse_endpoint(network.address); !endpoint) section.fail("listen", endpoint.error());
  if (!section.has("from")) return network;
  network.from = section.text("from");
  if (const auto from = parse_numeric_endpoint(network.from); !from) section.fail("from", from.error());
  return network;
}

Result<std::unique_ptr<Transport>> open_udp_line(const Settings& settings) {
  const std::string name = describe_udp_line(settings);
  auto endpoint = parse_endpoint(settings.network.address);
  if (!endpoint) return make_error(name, endpoint.error());
  std::optional<SocketAddress> from;
  bool sends = false;
  const std::string& peer = settings.network.listens ? settings.network.from : settings.network.address;
  if (!settings.network.listens) *endpoint = {endpoint->host.find(':') == std::string::npos ? "0.0.0.0" : "::", "0"};
  if (!peer.empty()) {
    const auto numeric = parse_numeric_endpoint(peer);
    const auto found = numeric_address(peer, SOCK_DGRAM);
    if (!found) return tl::unexpected<Error>(found.error());
    sends = !numeric->port.empty();
    from = *found;
  }
  auto line = std::make_unique<UdpLine>(name, *endpoint, from, sends);
  if (line->fd() < 0) return make_error(name, std::strerror(errno));
  if (const auto bound = line->bind_now(); !bound) return make_error(name, bound.error());
  return line;
}

std::string describe_udp_line(const Settings& settings) { return "udp " + settings.network.address; }

bool udp_line_is_present(const Settings&) { return false; }

}  // namespace prism::transport
