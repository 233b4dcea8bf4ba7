// SPDX-License-Identifier: MIT
#include "tools/client/async_connection.hpp"

#include <gtest/gtest.h>

#include <boost/asio/write.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.hpp"
#include "tools/client/response.hpp"

namespace prism::client {
namespace {

namespace asio = boost::asio;
using Protocol = asio::local::stream_protocol;

/// A connection to a fake prismd.
class AsyncConnectionTest : public ::testing::Test {
 protected:
  void SetUp() override {
    connection_->open(
        folder_.file("s"), [this](std::string_view line) { others_.emplace_back(line); },
        [this](const std::string& reason) { reason_ = reason; });
    settle();
    acceptor_.accept(server_);
    server_.non_blocking(true);
    settle();
  }
  void settle() {
    io_.restart();
    io_.run_for(std::chrono::milliseconds(20));
  }
  void call(const std::string& method) {
    EXPECT_TRUE(connection_->call(method, "{}", [this](std::string_view member) { answers_.emplace_back(member); }));
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

  test::TemporaryFolder folder_;
  asio::io_context io_;
  Protocol::acceptor acceptor_{io_, Protocol::endpoint(folder_.file("s"))};
  Protocol::socket server_{io_};
  const std::shared_ptr<AsyncConnection> connection_ = std::make_shared<AsyncConnection>(io_);
  std::string reason_;
  std::vector<std::string> answers_, others_;
};

// prismd closed the connection, which all clients share, after three requests at once with long responses.
TEST_F(AsyncConnectionTest, SendsTheNextRequestAfterTheResponse) {
  for (const char* method : {"a", "b", "c"}) call(method);
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

TEST_F(AsyncConnectionTest, PassesOnUnsolicitedLines) {
  call("a");
  send(R"({"jsonrpc":"2.0","method":"window","params":{}})");
  EXPECT_EQ(others_, std::vector<std::string>{R"({"jsonrpc":"2.0","method":"window","params":{}})"});
  EXPECT_TRUE(answers_.empty());
}

// A fake prismd may write another order of the members, or blanks.
TEST_F(AsyncConnectionTest, ReadsAnyJson) {
  call("a");
  send(R"({"id": 1, "result": {"b": 1}, "jsonrpc": "2.0"})");
  call("b");
  send(R"({"id": 2, "error": {"code": 3}})");
  EXPECT_EQ(answers_, (std::vector<std::string>{R"("result":{"b":1})", R"("error":{"code":3})"}));
  EXPECT_TRUE(others_.empty());
}

TEST_F(AsyncConnectionTest, EndsWithAReason) {
  send("no JSON");
  EXPECT_EQ(reason_, "sent \"no JSON\", expected a JSON object; is this prismd's socket?");
}

TEST_F(AsyncConnectionTest, PassesOnWhyItIsRejected) {
  send(R"({"jsonrpc":"2.0","id":null,"error":{"code":-32004,"message":"64 clients are connected"}})");
  EXPECT_EQ(reason_, "64 clients are connected");
}

TEST_F(AsyncConnectionTest, ReportsTheEndOfPrismd) {
  server_.close();
  settle();
  EXPECT_EQ(reason_, "prismd closed the connection");
  EXPECT_FALSE(connection_->is_open());
}

TEST_F(AsyncConnectionTest, SendsOneRequestAndBoundsItsQueue) {
  std::size_t queued = 0;
  while (connection_->call("a", "{}", [](std::string_view) {})) ++queued;
  EXPECT_EQ(queued, 256U);
  EXPECT_EQ(received().find("\"id\":2"), std::string::npos);
}

TEST_F(AsyncConnectionTest, FailsAllRequestsAtTheEnd) {
  for (const char* method : {"a", "b"}) call(method);
  connection_->end(R"("error":{})");
  EXPECT_EQ(answers_, (std::vector<std::string>{R"("error":{})", R"("error":{})"}));
  EXPECT_EQ(received().find("\"b\""), std::string::npos);
}

using nlohmann::json;

TEST(Response, HasTheCodeOfTheError) {
  const auto busy = response_of("rows", json::parse(R"({"id": 1, "error": {"code": -32004, "message": "later"}})"));
  EXPECT_EQ(busy.error().code, config::kBusy);
  EXPECT_EQ(busy.error().text(), "prismd: later");
  for (const char* text : {R"({"error": {}})", R"({"error": 3})", R"({"error": {"code": "-32004"}})"})
    EXPECT_EQ(response_of("version", json::parse(text)).error().code, config::kFailed) << text;
}

// Version 0.2 returns the members of the only axis in the result itself.
TEST(Response, OfAnOlderPrismdIsAnError) {
  EXPECT_EQ(response_of("bias", json::parse(R"({"result": {"axis": "z"}})")).error().text(),
            "prismd: found a response of protocol 1, expected 2: this prismd is older; restart it");
  EXPECT_TRUE(response_of("bias", json::parse(R"({"result": {"axes": {"z": {}}}})")));
  EXPECT_TRUE(response_of("line", json::parse(R"({"result": {"device": ""}})")));
}

TEST(Response, IsReadByAxis) {
  const json two = json::parse(R"({"axes": {"x": 1, "y": 2}})"), one = json::parse(R"({"axes": {"z": 3}})");
  EXPECT_EQ(of_axis(two, "y"), 2);
  EXPECT_EQ(of_axis(one, ""), 3);
  for (const json& none : {of_axis(two, ""), of_axis(one, "x"), of_axis(json(), ""), of_axis(json(3), "x")})
    EXPECT_TRUE(none.is_null()) << none;
}

TEST(Response, HasTheMembersOfAnAxis) {
  const json both =
      json::parse(R"({"state": 1, "log": {"rows": 5}, "axes": {"x": {"quality": 2, "log": {"a": 3}}, "y": 4}})");
  EXPECT_EQ(with_axis(both, "x"),
            json::parse(R"({"state": 1, "axis": "x", "quality": 2, "log": {"rows": 5, "a": 3}})"));
  EXPECT_EQ(with_axis(both, "y"), json::parse(R"({"state": 1, "axis": "y", "log": {"rows": 5}})"));
  EXPECT_EQ(with_axis(json::parse(R"({"log": 1, "axes": {"x": {"log": {"a": 3}}}})"), "x"),
            json::parse(R"({"axis": "x", "log": {"a": 3}})"));
}

}  // namespace
}  // namespace prism::client
