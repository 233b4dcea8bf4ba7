// SPDX-License-Identifier: MIT
#include "drivers/transport/raw_server.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "base/json_section.hpp"
#include "drivers/transport/endpoint.hpp"
#include "drivers/transport/resolver.hpp"
#include "drivers/transport/transport.hpp"

namespace prism::transport {
namespace {

constexpr int kReaderBytes = 1 << 20, kReaderBacklog = 16;

// Discards what the reader sent. Returns false if it is gone.
bool is_connected(int fd) {
  std::array<char, 4096> unused;
  const ssize_t size = ::recv(fd, unused.data(), unused.size(), MSG_DONTWAIT);
  return size > 0 || (size < 0 && (errno == EAGAIN || errno == EINTR));
}

}  // namespace

Result<std::unique_ptr<RawServer>> RawServer::open(const std::string& address) {
  const auto endpoint = parse_numeric_endpoint(address);
  if (!endpoint || endpoint->port.empty()) return make_error(address, "expected an IP address and a port");
  const auto found = Resolver(*endpoint, SOCK_STREAM, true).result();
  if (!found) return tl::unexpected<Error>(found.error());
  Descriptor listener;
  if (const int error = open_listener(found->front(), kReaderBacklog, listener); error != 0)
    return make_error(address, std::string("cannot serve the raw bytes: ") + std::strerror(error));
  return std::unique_ptr<RawServer>(new RawServer(address, std::move(listener)));
}

RawServer::RawServer(std::string address, Descriptor listener)
    : address_(std::move(address)), listener_(std::move(listener)) {
  waits_.wait_for(listener_.get(), EPOLLIN);
}

void RawServer::accept_and_forget() {
  std::erase_if(readers_, [](const Descriptor& reader) { return !is_connected(reader.get()); });
  for (;;) {
    Descriptor reader(::accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (reader.get() < 0) {
      listening_ = errno == EAGAIN || errno == EINTR || errno == ECONNABORTED;
      if (!listening_) waits_.wait_for(listener_.get(), 0);
      return;
    }
    if (readers_.size() >= kMostReaders) continue;
    ::setsockopt(reader.get(), SOL_SOCKET, SO_SNDBUF, &kReaderBytes, sizeof kReaderBytes);
    waits_.wait_for(reader.get(), EPOLLIN);
    readers_.push_back(std::move(reader));
  }
}

void RawServer::send(std::span<const std::uint8_t> bytes) {
  if (!std::exchange(listening_, true)) waits_.wait_for(listener_.get(), EPOLLIN);
  const auto is_slow = [&](const Descriptor& reader) {
    return ::send(reader.get(), bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL) !=
           static_cast<ssize_t>(bytes.size());
  };
  dropped_ += static_cast<std::uint64_t>(std::erase_if(readers_, is_slow));
}

std::string read_serving(const Section& section) {
  if (!section.has("raw")) return {};
  const Section raw = section.object("raw"), tcp = raw.object("tcp", true);
  const std::string address = tcp.text("listen");
  const auto endpoint = parse_numeric_endpoint(address);
  if (!endpoint)
    tcp.fail("listen", endpoint.error());
  else if (endpoint->port.empty())
    tcp.fail("listen", "found \"" + address + "\" without a port, expected ADDRESS:PORT");
  return address;
}

}  // namespace prism::transport
