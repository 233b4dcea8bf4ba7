// SPDX-License-Identifier: MIT
#include "tools/prismweb/listener.hpp"

#include <fmt/format.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <memory>
#include <utility>

#include "tools/prismweb/awaiting.hpp"
#include "tools/prismweb/http_session.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
constexpr int kBacklog = 64;
constexpr int kSendBufferBytes = 256 << 10;  // limits unread data of a client in the kernel
constexpr mode_t kSocketMode = 0660;

Result<int> listening(int fd, const sockaddr* address, socklen_t size, const std::string& where) {
  if (fd >= 0 && ::bind(fd, address, size) == 0 && ::listen(fd, kBacklog) == 0) return fd;
  const int error = errno;
  if (fd >= 0) ::close(fd);
  return make_error(where, fmt::format("cannot listen: {}", std::strerror(error)));
}

asio::awaitable<void> serve_one(Stream stream, WebServer& server, std::shared_ptr<ConnectionList> list,
                                std::shared_ptr<Connection> connection) {
  const ConnectionList::Entry entry(std::move(list), connection);
  co_await serve(std::move(stream), server, connection);
}

void ignore_exception(std::exception_ptr) {}  // of one connection; the others continue

}  // namespace

Listener::Listener(asio::io_context& io, int fd, int family, OwnSocketFile own)
    : io_(io),
      acceptor_(io, Protocol(family, family == AF_UNIX ? 0 : IPPROTO_TCP), fd),
      is_unix_(family == AF_UNIX),
      own_(std::move(own)) {}

Result<std::unique_ptr<Listener>> Listener::open_tcp(asio::io_context& io, const std::string& address,
                                                     std::uint16_t port) {
  boost::system::error_code error;
  const asio::ip::tcp::endpoint here(asio::ip::make_address(address, error), port);
  const int family = here.protocol().family();
  const int fd = ::socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0), on = 1;
  ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  const auto bound =
      listening(fd, here.data(), static_cast<socklen_t>(here.size()), fmt::format("{}:{}", address, port));
  if (!bound) return tl::unexpected<Error>(bound.error());
  std::unique_ptr<Listener> listener(new Listener(io, *bound, family, OwnSocketFile()));
  asio::ip::tcp::endpoint there;
  socklen_t size = static_cast<socklen_t>(there.capacity());
  if (::getsockname(fd, there.data(), &size) == 0) listener->port_ = there.port();
  return listener;
}

Result<std::unique_ptr<Listener>> Listener::open_unix(asio::io_context& io, const std::string& path) {
  auto socket = listen_unix(path, kSocketMode);
  if (!socket) return tl::unexpected<Error>(socket.error());
  return std::unique_ptr<Listener>(new Listener(io, socket->release(), AF_UNIX, OwnSocketFile(path)));
}

asio::awaitable<void> Listener::serve_all(WebServer& server) {
  asio::steady_timer pause(io_);
  for (;;) {
    Protocol::socket socket(io_);
    const auto [error] = co_await acceptor_.async_accept(socket, kUse);
    if (error == asio::error::operation_aborted) co_return;
    if (error) {  // no free descriptor: retry
      pause.expires_after(std::chrono::milliseconds(100));
      co_await pause.async_wait(kUse);
      continue;
    }
    if (connections_->make_room()) serve_socket(std::move(socket), server);
  }
}

void Listener::serve_socket(Protocol::socket socket, WebServer& server) {
  const int on = 1, buffer = kSendBufferBytes;
  ::setsockopt(socket.native_handle(), SOL_SOCKET, SO_SNDBUF, &buffer, sizeof buffer);
  if (!is_unix_) ::setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  const auto connection = std::make_shared<Connection>();
  connection->fd = socket.native_handle();
  asio::co_spawn(io_, serve_one(Stream(std::move(socket)), server, connections_, connection), ignore_exception);
}

}  // namespace prism::prismweb
