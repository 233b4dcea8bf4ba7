// SPDX-License-Identifier: MIT
#include "daemon/socket/server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <deque>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "base/time_scale.hpp"
#include "daemon/awaiting.hpp"

namespace prism::socket {
namespace {

namespace asio = boost::asio;
using daemon::kUse;
using pipeline::Severity;
using Protocol = asio::local::stream_protocol;

}  // namespace

Server::Server(asio::io_context& io, config::SocketSettings settings, Publisher& publisher, Rpc& rpc,
               pipeline::Tell tell, Problems& problems)
    : acceptor_(io),
      settings_(std::move(settings)),
      publisher_(publisher),
      tell_(std::move(tell)),
      problems_(problems),
      rpc_(rpc),
      turn_(io, 1) {}

Result<void> Server::listen(std::optional<int> inherited) {
  boost::system::error_code error;
  if (inherited) {
    acceptor_.assign(Protocol(), *inherited, error);
    if (error) return make_error("systemd's socket", error.message());
    return {};
  }
  std::error_code folder_error;  // listen_unix() reports the error
  std::filesystem::create_directories(std::filesystem::path(settings_.path).parent_path(), folder_error);
  auto socket = listen_unix(settings_.path, static_cast<mode_t>(settings_.mode));
  if (!socket) return tl::unexpected<Error>(socket.error());
  acceptor_.assign(Protocol(), socket->get(), error);
  if (error) return make_error(settings_.path, "cannot listen: " + error.message());
  socket->release();
  own_.emplace(settings_.path);
  return {};
}

asio::awaitable<void> Server::serve() {
  asio::steady_timer pause(acceptor_.get_executor());
  for (;;) {
    auto [error, socket] = co_await acceptor_.async_accept(kUse);
    if (error == asio::error::operation_aborted) co_return;
    if (error) {  // most likely no free descriptors: do not retry in a busy loop
      tell_(Severity::kWarning, "accept", "socket: a client cannot be accepted: " + error.message());
      pause.expires_after(std::chrono::seconds(1));
      co_await pause.async_wait(kUse);
      continue;
    }
    auto client =
        std::make_shared<Client>(std::move(socket), static_cast<std::size_t>(settings_.client_buffer_bytes), memory_);
    if (const std::string refused = admit(*client); !refused.empty()) {
      client->answer(rpc_error(nullptr, kBusy, refused));
      continue;
    }
    publisher_.add(client);
    asio::co_spawn(acceptor_.get_executor(), talk(std::move(client)), asio::detached);
  }
}

void Server::watch_file() {
  if (!own_ || own_->is_in_place()) return problems_.clear("socket", settings_.path + ": clients can connect again");
  problems_.set("socket", {.kind = "socket",
                           .text = settings_.path +
                                   ": the socket's file was removed or replaced, new clients cannot connect; restart "
                                   "prismd"});
}

std::string Server::admit(const Client& client) {
  const auto most = static_cast<std::size_t>(settings_.max_clients);
  std::vector<Client*> open, of_user;
  for (const auto& other : publisher_.all()) {
    if (!other->open()) continue;
    open.push_back(other.get());
    if (other->user() == client.user()) of_user.push_back(other.get());
  }
  const bool too_many_of_user = !client.privileged() && of_user.size() >= std::max<std::size_t>(most * 3 / 4, 1);
  if (open.size() < most && !too_many_of_user) return {};
  const std::vector<Client*>& among = too_many_of_user ? of_user : open;
  const auto idlest = std::max_element(among.begin(), among.end(),
                                       [](const Client* a, const Client* b) { return a->idle() < b->idle(); });
  const auto stranger = std::find_if(open.rbegin(), open.rend(), [](const Client* c) { return !c->privileged(); });
  if (idlest != among.end() && (*idlest)->idle() >= scaled(kIdle)) {
    (*idlest)->close();
  } else if (client.privileged() && stranger != open.rend()) {
    (*stranger)->close();
  } else {
    const char* const whose = too_many_of_user ? "clients of this user are connected" : "clients are connected";
    return fmt::format("{} {}, expected fewer; try again later", among.size(), whose);
  }
  return {};
}

// Reads no more requests from a client until the previous ones are answered.
asio::awaitable<void> Server::talk(std::shared_ptr<Client> client) {
  std::string pending;
  auto buffer = asio::dynamic_buffer(pending, kMaxRequestBytes + 1);
  while (client->open()) {
    auto [error, size] = co_await asio::async_read_until(client->socket(), buffer, '\n', kUse);
    if (error == asio::error::not_found) {
      client->answer(rpc_error(nullptr, kInvalidRequest,
                               fmt::format("found a line of more than {} bytes; connection closed", kMaxRequestBytes)));
    }
    if (error) break;
    std::string_view line(pending.data(), size - 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    std::deque<nlohmann::json> requests;
    for (bool parsed = line.empty(); !parsed || !requests.empty(); parsed = true) {
      co_await turn_.async_send(boost::system::error_code(), kUse);
      if (client->gone()) client->close();
      if (!client->open()) {
        requests.clear();
      } else if (!parsed) {
        requests = rpc_.take(client, line);
      } else {
        rpc_.one(client, std::move(requests.front()));
        requests.pop_front();
      }
      turn_.try_receive([](boost::system::error_code) {});
    }
    pending.erase(0, size);
  }
  client->close();
  publisher_.remove(client.get());
}

}  // namespace prism::socket
