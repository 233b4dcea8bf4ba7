// SPDX-License-Identifier: MIT
// The socket of prismd and its clients, as scripts: connections and requests (server.txt), clients of another user
// (server_users.txt).
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/socket/server.hpp"
#include "tests/support/daemon_parts.hpp"
#include "tests/support/disk_files.hpp"
#include "tests/support/scripts.hpp"

namespace prism::socket {
namespace {

using test::next;
using Lines = std::vector<std::string>;
using Protocol = boost::asio::local::stream_protocol;

constexpr uid_t kOther = 65534;

/// A server at the path "socket". "connect NAME", "say NAME LINE"; each answer is printed as CODE MESSAGE, or "result".
class ServerPlayer : test::DaemonPartsTest {
 public:
  ~ServerPlayer() override {
    ::unsetenv("PRISM_TIME_SCALE");
    for (const auto& client : std::vector(parts_->publisher.all())) client->close();
    poll();
    for (const auto& client : std::vector(parts_->publisher.all())) parts_->publisher.remove(client.get());
  }

  Lines play(const std::string& command, std::istream& words) {
    if (command == "open") {  // [CLIENTS [MODE]]
      settings_.path = folder_.file("new/socket");
      settings_.max_clients = next<int>(words, 256);
      settings_.mode = std::stoi(next<std::string>(words, "660"), nullptr, 8);
      return open(std::nullopt);
    } else if (command == "inherit") {  // a socket of systemd
      settings_.path = folder_.file("inherited");
      Descriptor listening = std::move(*listen_unix(settings_.path, 0600));
      return open(listening.release());
    } else if (command == "close") {
      server_.reset();
      poll();
    } else if (command == "mode") {
      struct stat status {};
      if (::stat(settings_.path.c_str(), &status) != 0) return {"no file"};
      return {fmt::format("{:o}", status.st_mode & 0777)};
    } else if (command == "file") {  // instead of the socket
      test::write_file(settings_.path, "");
    } else if (command == "remove") {
      std::filesystem::remove(settings_.path);
    } else if (command == "move") {
      const auto from = next<std::string>(words);
      std::filesystem::rename(folder_.file(from), folder_.file(next<std::string>(words)));
    } else if (command == "watch") {
      server_->watch_file();
      Lines lines;
      for (; events_ < parts_->events.recent().size(); ++events_)
        lines.push_back(shown(parts_->events.recent()[events_].text));
      if (parts_->problems.has("socket")) lines.emplace_back("is a problem");
      return lines;
    } else if (command == "connect") {  // NAME [other_user]
      const auto name = next<std::string>(words);
      connect(name, !next<std::string>(words).empty());
      return answers(name);
    } else if (command == "later") {  // the same when another client has been idle for long enough
      ::setenv("PRISM_TIME_SCALE", "100", 1);
      const auto name = next<std::string>(words);
      const bool is_other = !next<std::string>(words).empty();
      do {
        connect(name, is_other);
      } while (!answers(name).empty());
    } else if (command == "say") {
      const auto name = next<std::string>(words);
      write(name, test::rest_of(words) + "\n");
      return answers(name);
    } else if (command == "write") {  // without a line end, which is \n
      const auto name = next<std::string>(words);
      write(name, test::rest_of(words));
      return answers(name);
    } else if (command == "hang_up") {
      peers_.erase(next<std::string>(words));
      poll();
    } else if (command == "clients") {
      std::size_t open = 0;
      for (const auto& client : parts_->publisher.all()) open += client->open();
      return {fmt::format("{} of {} open", open, parts_->publisher.clients())};
    } else {
      return {"unknown command"};
    }
    return {};
  }

 private:
  void TestBody() override {}

  Lines open(std::optional<int> inherited) {
    if (::geteuid() == 0) std::filesystem::permissions(folder_.file(""), std::filesystem::perms(0711));
    auto made =
        std::make_unique<Server>(io_, settings_, parts_->publisher, rpc_, parts_->events.teller(), parts_->problems);
    if (const auto listening = made->listen(inherited); !listening) return {shown(listening.error().text())};
    server_ = std::move(made);
    boost::asio::co_spawn(io_, server_->serve(), boost::asio::detached);
    poll();
    return {};
  }

  std::string shown(std::string text) const {
    for (std::size_t at; (at = text.find(folder_.file(""))) != std::string::npos;)
      text.erase(at, folder_.file("").size());
    return text;
  }

  void poll() {
    io_.restart();
    io_.poll();
  }
  void connect(const std::string& name, bool is_other_user) {
    peers_.erase(name);
    Protocol::socket socket(io_);
    EXPECT_EQ(is_other_user ? ::seteuid(kOther) : 0, 0);
    socket.connect(Protocol::endpoint(settings_.path));
    EXPECT_EQ(is_other_user ? ::seteuid(0) : 0, 0);
    socket.non_blocking(true);
    peers_.emplace(name, std::move(socket));
    poll();
  }
  void write(const std::string& name, const std::string& text) {
    for (std::size_t done = 0; done < text.size(); poll()) {
      const ssize_t size =
          ::send(peers_.at(name).native_handle(), text.data() + done, text.size() - done, MSG_NOSIGNAL);
      if (size < 0) return;
      done += static_cast<std::size_t>(size);
    }
  }
  Lines answers(const std::string& name) {
    std::string text;
    bool closed = false;
    for (char buffer[65536];;) {
      poll();
      const ssize_t size = ::recv(peers_.at(name).native_handle(), buffer, sizeof buffer, MSG_DONTWAIT);
      closed = size == 0 || (size < 0 && errno == ECONNRESET);
      if (size <= 0) break;
      text.append(buffer, static_cast<std::size_t>(size));
    }
    Lines lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) {
      const auto answer = nlohmann::json::parse(line);
      lines.push_back(answer["id"].dump() + ": " +
                      (answer.contains("error") ? fmt::format("{} {}", answer["error"]["code"].get<int>(),
                                                              answer["error"]["message"].get<std::string>())
                                                : "result"));
    }
    if (closed) lines.emplace_back("closed");
    return lines;
  }

  boost::asio::io_context io_;
  Rpc rpc_ = parts_->rpc();
  config::SocketSettings settings_;
  std::size_t events_ = 0;  ///< that were printed
  std::unique_ptr<Server> server_;
  std::map<std::string, Protocol::socket> peers_;
};

TEST(Server, Scripts) { test::expect_scripts<ServerPlayer>("socket/server.txt"); }

TEST(Server, ScriptsOfUsers) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root, to connect as another user";
  test::expect_scripts<ServerPlayer>("socket/server_users.txt");
}

}  // namespace
}  // namespace prism::socket
