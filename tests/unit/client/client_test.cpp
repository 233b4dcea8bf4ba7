// SPDX-License-Identifier: MIT
#include "tools/client/client.hpp"

#include <gtest/gtest.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/write.hpp>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace prism::client {
namespace {

namespace asio = boost::asio;
using Protocol = asio::local::stream_protocol;
using nlohmann::json;
using std::chrono_literals::operator""ms;

/// A client of a fake prismd, which `connect` starts. The session waits until the connection ends.
class ClientTest : public ::testing::Test {
 protected:
  static constexpr auto kTimeout = 400ms;

  void SetUp() override {
    ::setenv("PRISM_TIME_SCALE", "100", 1);
    client_.emplace(io_, folder_.file("gyro1.sock"), kTimeout);
    client_->on_notification = [this](std::string_view line) { notifications_.emplace_back(line); };
    client_->on_end = [this](State state, const std::string& reason) { ends_.emplace_back(state, reason); };
    const Client::Session session = [this]() -> asio::awaitable<std::string> {
      ++sessions_;
      asio::steady_timer forever(io_, std::chrono::hours(1));
      co_await forever.async_wait(kUse);
      co_return "";
    };
    asio::co_spawn(io_, client_->run(session), asio::detached);
  }
  void TearDown() override {
    client_->close();
    settle();
    ::unsetenv("PRISM_TIME_SCALE");
  }

  void settle(std::chrono::milliseconds time = 20ms) {
    io_.restart();
    io_.run_for(time);
  }
  void connect() {
    if (!acceptor_) acceptor_.emplace(io_, Protocol::endpoint(client_->socket()));
    server_ = Protocol::socket(io_);
    for (int i = 0; i < 20 && client_->state() != State::kConnected; ++i) settle();
    acceptor_->accept(server_);
    server_.non_blocking(true);
  }
  void ask(const std::string& method) {
    const auto asked = [](Client& client, std::string name,
                          std::vector<std::string>& answers) -> asio::awaitable<void> {
      answers.push_back(co_await client.ask_text(name));
    };
    asio::co_spawn(io_, asked(*client_, method, answers_), asio::detached);
  }
  std::string received() {
    settle();
    std::string text(1 << 16, '\0');
    boost::system::error_code error;
    text.resize(server_.read_some(asio::buffer(text), error));
    return text;
  }
  void send(const std::string& line) {
    asio::write(server_, asio::buffer(line + "\n"));
    settle();
  }
  std::string reason() const { return ends_.empty() ? "" : ends_.back().second; }

  test::TemporaryFolder folder_;
  asio::io_context io_;
  std::optional<Client> client_;
  std::optional<Protocol::acceptor> acceptor_;
  Protocol::socket server_{io_};
  int sessions_ = 0;
  std::vector<std::pair<State, std::string>> ends_;
  std::vector<std::string> answers_, notifications_;
};

// prismd closed the connection, which all clients share, after three requests at once with long responses.
TEST_F(ClientTest, SendsTheNextRequestAfterTheResponse) {
  connect();
  for (const char* method : {"a", "b", "c"}) ask(method);
  EXPECT_EQ(received(), R"({"jsonrpc":"2.0","id":1,"method":"a","params":{},"protocol":2})"
                        "\n");
  EXPECT_EQ(received(), "");
  send(R"({"jsonrpc":"2.0","id":1,"result":1})");
  EXPECT_EQ(answers_, std::vector<std::string>{R"("result":1)"});
  EXPECT_NE(received().find("\"b\""), std::string::npos);
  send(R"({"jsonrpc":"2.0","id":1,"result":1})");
  EXPECT_EQ(answers_.size(), 1U) << "a repeated response is ignored";
  EXPECT_EQ(received(), "");
}

TEST_F(ClientTest, PassesOnNotifications) {
  connect();
  ask("a");
  send(R"({"jsonrpc":"2.0","method":"window","params":{}})");
  send(R"({"method": "event", "params": {}})");
  EXPECT_EQ(notifications_, (std::vector<std::string>{R"({"jsonrpc":"2.0","method":"window","params":{}})",
                                                      R"({"method": "event", "params": {}})"}));
  EXPECT_TRUE(answers_.empty());
}

// A fake prismd may write another order of the members, or blanks.
TEST_F(ClientTest, ReadsAnyJson) {
  connect();
  ask("a");
  settle();
  send(R"({"id": 1, "result": {"b": 1}, "jsonrpc": "2.0"})");
  ask("b");
  settle();
  send(R"({"id": 2, "error": {"code": 3}})");
  EXPECT_EQ(answers_, (std::vector<std::string>{R"("result":{"b":1})", R"("error":{"code":3})"}));
  send(R"({"id": 0, "result": {}})");
  EXPECT_EQ(client_->state(), State::kConnected);
}

TEST_F(ClientTest, ParsesResponses) {
  connect();
  std::optional<Response> response;
  const auto asked = [](Client& client, std::optional<Response>& to) -> asio::awaitable<void> {
    to = co_await client.ask("line");
  };
  asio::co_spawn(io_, asked(*client_, response), asio::detached);
  settle();
  send(R"({"jsonrpc":"2.0","id":1,"result":{"device":""}})");
  ASSERT_TRUE(response && *response);
  EXPECT_EQ(**response, json({{"device", ""}}));
}

TEST_F(ClientTest, EndsWithAReason) {
  connect();
  send("no JSON");
  EXPECT_EQ(ends_[0],
            std::pair(State::kGone, std::string("sent \"no JSON\", expected a JSON object; is this prismd's socket?")));
  connect();
  send(R"({"jsonrpc":"2.0","id":null,"error":{"code":-32004,"message":"64 clients are connected"}})");
  EXPECT_EQ(reason(), "64 clients are connected");
  connect();
  client_->end("does not please");
  settle();
  EXPECT_EQ(reason(), "does not please");
}

TEST_F(ClientTest, ReconnectsAndStartsASessionEachTime) {
  settle();
  EXPECT_EQ(reason(), "no prismd answers: No such file or directory");
  connect();
  EXPECT_EQ(sessions_, 1);
  ask("a");
  settle();
  server_.close();
  settle(5ms);
  EXPECT_EQ(reason(), "prismd closed the connection");
  EXPECT_EQ(answers_, std::vector<std::string>{R"("error":{"code":-32003,"message":"gyro1 disconnected"})"});
  connect();
  EXPECT_EQ(sessions_, 2);
  ask("b");
  EXPECT_NE(received().find("\"b\""), std::string::npos);
}

TEST_F(ClientTest, AsksNothingWithoutAConnection) {
  settle();
  ask("a");
  settle();
  EXPECT_EQ(answers_, std::vector<std::string>{R"("error":{"code":-32003,"message":"gyro1 is not running"})"});
}

TEST_F(ClientTest, BoundsItsQueue) {
  connect();
  for (int i = 0; i < 257; ++i) ask("a");
  EXPECT_EQ(received().find("\"id\":2"), std::string::npos);
  ASSERT_EQ(answers_.size(), 1U);
  EXPECT_NE(answers_[0].find("too many requests pending for gyro1"), std::string::npos);
}

TEST_F(ClientTest, ReconnectsIfPrismdDoesNotRespond) {
  connect();
  ask("a");
  settle(500ms);
  EXPECT_EQ(answers_,
            std::vector<std::string>{R"("error":{"code":-32006,"message":"gyro1 did not respond within 0.4 s"})"});
  EXPECT_EQ(reason(), "prismd did not respond to a");
}

// The first request waited for an earlier response; the connection does not end because of it.
TEST_F(ClientTest, ExpiresRequestsThatWereSentLate) {
  connect();
  for (const char* method : {"a", "b", "c"}) ask(method);
  settle(300ms);
  send(R"({"jsonrpc":"2.0","id":1,"result":1})");
  settle(200ms);
  EXPECT_EQ(answers_.size(), 3U);
  EXPECT_EQ(client_->state(), State::kConnected);
  ask("d");
  send(R"({"jsonrpc":"2.0","id":2,"result":1})");
  const std::string sent = received();
  EXPECT_NE(sent.find("\"d\""), std::string::npos) << sent;
  EXPECT_EQ(sent.find("\"c\""), std::string::npos) << sent;
}

TEST_F(ClientTest, NeverStartsAStoppedInstance) {
  std::filesystem::create_directories(folder_.file("activated"));
  std::filesystem::create_directories(folder_.file("running"));
  std::filesystem::create_symlink("/nowhere", folder_.file("activated/gyro1.sock"));
  acceptor_.emplace(io_, Protocol::endpoint(client_->socket()));
  settle(100ms);
  EXPECT_EQ(sessions_, 0);
  EXPECT_EQ(ends_.back().first, State::kStopped);
  std::ofstream(folder_.file("running/gyro1")) << "";
  connect();
  EXPECT_EQ(sessions_, 1);
  server_.close();  // as a service that is stopping: the file is removed only after this
  settle(200ms);
  EXPECT_EQ(sessions_, 1);
  std::filesystem::remove(folder_.file("running/gyro1"));
  settle(100ms);
  EXPECT_EQ(ends_.back().first, State::kStopped);
  std::ofstream(folder_.file("running/other")) << "";  // another inode
  std::filesystem::rename(folder_.file("running/other"), folder_.file("running/gyro1"));
  connect();
  EXPECT_EQ(sessions_, 2);
}

TEST(Client, OnceReturnsTheReason) {
  const test::TemporaryFolder folder;
  asio::io_context io;
  Client client(io, folder.file("gyro1.sock"));
  std::vector<std::string> reasons;
  const Client::Session session = [&]() -> asio::awaitable<std::string> { co_return "done"; };
  const auto once = [&]() -> asio::awaitable<void> { reasons.push_back(co_await client.once(session)); };
  asio::co_spawn(io, once(), asio::detached);
  io.run();
  const Protocol::acceptor acceptor(io, Protocol::endpoint(client.socket()));
  io.restart();
  asio::co_spawn(io, once(), asio::detached);
  io.run();
  EXPECT_EQ(reasons, (std::vector<std::string>{"no prismd answers: No such file or directory", "done"}));
  Client long_path(io, "/" + std::string(200, 'x'));
  const auto long_once = [&]() -> asio::awaitable<void> { reasons.push_back(co_await long_path.once(session)); };
  io.restart();
  asio::co_spawn(io, long_once(), asio::detached);
  io.run();
  EXPECT_EQ(reasons.back(), "no prismd answers: File name too long");
}

}  // namespace
}  // namespace prism::client
