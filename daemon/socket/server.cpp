// SPDX-License-Identifier: MIT
#include "daemon/socket/server.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <deque>
#include <filesystem>
#include <utility>

#include "base/file.hpp"
#include "daemon/awaiting.hpp"

namespace prism::socket {
namespace {

namespace asio = boost::asio;
using daemon::kUse;
using pipeline::Severity;
using Protocol = asio::local::stream_protocol;

// Does not wait: a connect to a socket whose queue is full would block until its owner accepts, which may be never.
bool somebody_listens(const std::string& path) {
  const int probe = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const Protocol::endpoint there(path);
  const bool listens =
      ::connect(probe, static_cast<const sockaddr*>(there.data()), static_cast<socklen_t>(there.size())) == 0 ||
      errno == EAGAIN;
  ::close(probe);
  return listens;
}

Result<Server::Acceptor> listen(asio::io_context& io, const config::SocketSettings& settings) {
  if (settings.path.size() >= sizeof(sockaddr_un::sun_path)) {
    return refuse(settings.path, fmt::format("has {} bytes, expected at most {}", settings.path.size(),
                                             sizeof(sockaddr_un::sun_path) - 1));
  }
  std::error_code folder_error;
  std::filesystem::create_directories(std::filesystem::path(settings.path).parent_path(), folder_error);
  struct stat info {};
  if (::lstat(settings.path.c_str(), &info) == 0) {
    if (!S_ISSOCK(info.st_mode)) return refuse(settings.path, "is there and is no socket; expected a free path");
    if (somebody_listens(settings.path))
      return refuse(settings.path, "another process listens there; expected a free path");
    ::unlink(settings.path.c_str());
  }
  boost::system::error_code error;
  Server::Acceptor acceptor(io);
  acceptor.open(Protocol(), error);
  const mode_t before = ::umask(0777);  // nobody enters before the mode is right
  if (!error) acceptor.bind(Protocol::endpoint(settings.path), error);
  ::umask(before);
  if (error) return refuse(settings.path, "cannot be made: " + error.message());
  if (::chmod(settings.path.c_str(), static_cast<mode_t>(settings.mode)) != 0) {
    return refuse(settings.path, std::string("its mode cannot be set: ") + std::strerror(errno));
  }
  acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error) return refuse(settings.path, "cannot listen: " + error.message());
  return acceptor;
}

// Whole lines, without their ends; what is left stays pending.
std::deque<std::string> take_lines(std::string& pending) {
  std::deque<std::string> lines;
  std::size_t begin = 0;
  for (std::size_t end; (end = pending.find('\n', begin)) != std::string::npos; begin = end + 1) {
    std::string_view line(pending.data() + begin, end - begin);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    if (!line.empty()) lines.emplace_back(line);
  }
  pending.erase(0, begin);
  return lines;
}

std::string too_long() {
  return rpc_error(nullptr, kInvalidRequest,
                   fmt::format("a line of more than {} bytes; the connection is closed", kMaxRequestBytes));
}

}  // namespace

Result<std::unique_ptr<Server>> Server::open(asio::io_context& io, const config::SocketSettings& settings,
                                             int inherited, Publisher& publisher, Rpc& rpc, pipeline::Tell tell) {
  if (inherited >= 0) {
    boost::system::error_code error;
    Acceptor acceptor(io);
    acceptor.assign(Protocol(), inherited, error);
    if (error) return refuse("systemd's socket", error.message());
    return std::unique_ptr<Server>(
        new Server(std::move(acceptor), settings, std::nullopt, publisher, rpc, std::move(tell)));
  }
  Result<Acceptor> acceptor = listen(io, settings);
  if (!acceptor) return tl::unexpected<Error>(acceptor.error());
  return std::unique_ptr<Server>(
      new Server(std::move(*acceptor), settings, FileId::of(settings.path), publisher, rpc, std::move(tell)));
}

Server::Server(Acceptor acceptor, config::SocketSettings settings, std::optional<FileId> own, Publisher& publisher,
               Rpc& rpc, pipeline::Tell tell)
    : acceptor_(std::move(acceptor)),
      settings_(std::move(settings)),
      own_(own),
      publisher_(publisher),
      tell_(std::move(tell)),
      requests_(acceptor_.get_executor(), rpc) {}

Server::~Server() {
  // Another process may have put its own socket there since.
  if (own_ && FileId::of(settings_.path) == own_) ::unlink(settings_.path.c_str());
}

asio::awaitable<void> Server::serve() {
  asio::steady_timer pause(acceptor_.get_executor());
  for (;;) {
    auto [error, socket] = co_await acceptor_.async_accept(kUse);
    if (error == asio::error::operation_aborted) co_return;
    if (error) {  // out of descriptors, most likely: a storm of refusals helps nobody
      tell_(Severity::kWarning, "accept", "socket: a client cannot be accepted: " + error.message());
      pause.expires_after(std::chrono::seconds(1));
      co_await pause.async_wait(kUse);
      continue;
    }
    auto client =
        std::make_shared<Client>(std::move(socket), static_cast<std::size_t>(settings_.client_buffer_bytes), memory_);
    if (const std::string refused = admit(*client); !refused.empty()) {
      client->answer(rpc_error(nullptr, kRefused, refused));
      continue;
    }
    publisher_.add(client);
    asio::co_spawn(acceptor_.get_executor(), talk(std::move(client)), asio::detached);
  }
}

std::string Server::admit(const Client& client) {
  const auto most = static_cast<std::size_t>(settings_.max_clients);
  const auto& all = publisher_.all();
  const bool privileged = client.privileged();
  std::size_t open = 0, same_user = 0;
  Client *idlest = nullptr, *idlest_of_user = nullptr, *youngest_stranger = nullptr;
  const auto idler = [](Client* other, Client* than) { return than == nullptr || other->idle() > than->idle(); };
  for (const auto& other : all) {
    if (!other->open()) continue;
    ++open;
    const bool same = other->user() == client.user();
    same_user += same;
    if (other->idle() >= kIdle && idler(other.get(), idlest)) idlest = other.get();
    if (same && other->idle() >= kIdle && idler(other.get(), idlest_of_user)) idlest_of_user = other.get();
    if (!other->privileged()) youngest_stranger = other.get();
  }
  const bool too_many_of_user = !privileged && same_user >= std::max<std::size_t>(most * 3 / 4, 1);
  if (open < most && !too_many_of_user) return {};
  Client* const gives_way = too_many_of_user    ? idlest_of_user
                            : idlest != nullptr ? idlest
                            : privileged        ? youngest_stranger
                                                : nullptr;
  if (gives_way == nullptr) {
    return too_many_of_user
               ? fmt::format("{} clients of this user are connected, expected fewer: try again later", same_user)
               : fmt::format("{} clients are connected, expected fewer: try again later", open);
  }
  gives_way->close();
  return {};
}

// Reads no more from a client before what it asked for is answered.
asio::awaitable<void> Server::talk(std::shared_ptr<Client> client) {
  std::array<char, 4096> buffer;
  std::string pending;
  asio::steady_timer answered(acceptor_.get_executor());
  while (client->open()) {
    auto [error, size] = co_await client->socket().async_read_some(asio::buffer(buffer), kUse);
    if (error) break;
    pending.append(buffer.data(), size);
    std::deque<std::string> lines = take_lines(pending);
    if (!lines.empty()) {
      answered.expires_at(asio::steady_timer::time_point::max());
      requests_.add(client, std::move(lines), [&answered] { answered.cancel(); });
      co_await answered.async_wait(kUse);
    }
    if (pending.size() <= kMaxRequestBytes) continue;
    client->answer(too_long());
    break;
  }
  client->close();
  publisher_.remove(client.get());
}

}  // namespace prism::socket
