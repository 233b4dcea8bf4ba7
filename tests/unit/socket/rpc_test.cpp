// SPDX-License-Identifier: MIT
#include "daemon/socket/rpc.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/blocks.hpp"
#include "tests/support/daemon_parts.hpp"

namespace prism::socket {
namespace {

using nlohmann::json;

class RpcTest : public test::DaemonPartsTest {
 protected:
  int code(const std::string& line) { return asker_.ask(rpc_, line).at("error").at("code").get<int>(); }

  int reloads_ = 0;
  Rpc rpc_ = parts_->rpc([this](auto done) {
    ++reloads_;
    done(make_error("gyro.json", "no"));
  });
  test::Asker asker_;
};

TEST_F(RpcTest, EveryMethodAnswersItsId) {
  for (const config::SocketMethod& method : config::kSocketMethods) {
    const json answer = asker_.ask(
        rpc_, json{{"jsonrpc", "2.0"}, {"protocol", 2}, {"id", method.name}, {"method", method.name}}.dump());
    EXPECT_EQ(answer["id"], method.name);
    const bool sends = method.name == "send";                                      // without bytes
    const bool fails = method.name == "rows" || method.name == "reload" || sends;  // without a log, a reload
    EXPECT_EQ(answer.contains("result"), !fails) << answer;
    EXPECT_TRUE(!fails || answer["error"]["code"] == (sends                   ? kInvalidParams
                                                      : method.name == "rows" ? kNoLog
                                                                              : kFailed))
        << answer;
  }
}

// A client of 0.2 would look for the members of the axis in the result itself.
TEST_F(RpcTest, AnOlderClientGetsOneSentence) {
  begin_session();
  feed(4);
  for (const config::SocketMethod& method : config::kSocketMethods) {
    for (json request : {json{{"jsonrpc", "2.0"}}, json{{"jsonrpc", "2.0"}, {"protocol", 1}}}) {
      request.update({{"id", 1}, {"method", method.name}});
      const json answer = asker_.ask(rpc_, request.dump());
      if (!method.of_axes) {
        EXPECT_EQ(answer, asker_.ask(rpc_, method.name, nullptr)) << "the same in both protocols";
        continue;
      }
      EXPECT_EQ(answer["error"]["code"], kInvalidRequest) << method.name;
      EXPECT_EQ(answer["error"]["message"],
                "expected \"protocol\": 2 in the request: this client is older than prism 0.3; upgrade it");
    }
  }
}

TEST_F(RpcTest, AProgramDecidesByTheCode) {
  EXPECT_EQ(asker_.ask(rpc_, "rows", nullptr)["error"]["code"], kNoLog);
  EXPECT_EQ(asker_.ask(rpc_, "fly", nullptr)["error"]["code"], kUnknownMethod);
  EXPECT_EQ(asker_.ask(rpc_, "version", nullptr)["result"]["protocol"], 2);
}

TEST_F(RpcTest, RefusesWhatIsNoRequest) {
  for (const test::Block& row : test::blocks("socket/request_errors.txt", 2))
    EXPECT_EQ(code(row[0]), std::stoi(row[1])) << row.where;
}

// Parsing 65 kB would delay the line by milliseconds.
TEST_F(RpcTest, ALineOfVeryManyValuesIsRefusedBeforeItIsKept) {
  const std::string deep = std::string(3000, '[') + std::string(3000, ']');
  std::string flat = "[1";
  for (int i = 0; i < 30'000; ++i) flat += ",1";
  for (const std::string& line : {deep, flat + "]", flat + ", and no JSON"}) {
    const json answer = asker_.ask(rpc_, line);
    EXPECT_EQ(answer["error"]["code"], kInvalidRequest);
    EXPECT_EQ(answer["error"]["message"], "found more than 2000 values in a line, expected at most 100 requests");
  }
}

TEST_F(RpcTest, AFullBatchOfTheRichestRequestIsAnswered) {
  std::string line = "[";
  for (int i = 0; i < 100; ++i) {
    line +=
        R"({"jsonrpc": "2.0", "id": 1, "method": "subscribe", "params": {"streams": ["sample", "window", "event"], "every": 2}})";
    line += i < 99 ? ", " : "]";
  }
  rpc_.request(asker_.client(), line);
  const std::string text = asker_.read();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 100);
  EXPECT_EQ(text.find("error"), std::string::npos);
}

TEST_F(RpcTest, ANotificationIsNotAnswered) {
  rpc_.request(asker_.client(), R"({"jsonrpc":"2.0","method":"status"})");
  rpc_.request(asker_.client(), R"({"jsonrpc":"2.0","method":"history"})");
  rpc_.request(asker_.client(), R"({"jsonrpc":"2.0","method":"fly"})");
  EXPECT_EQ(asker_.read(), "");
}

TEST_F(RpcTest, AReloadTellsItsRefusal) {
  const json answer = asker_.ask(rpc_, R"({"jsonrpc":"2.0","id":1,"method":"reload"})");
  EXPECT_EQ(answer["error"]["code"], kFailed);
  EXPECT_EQ(answer["error"]["message"], "gyro.json: no");
  EXPECT_EQ(reloads_, 1);
}

TEST_F(RpcTest, SendsBytesToTheDevice) {
  const auto ask = [this](const std::string& params) {
    return asker_.ask(rpc_, R"({"jsonrpc":"2.0","id":1,"method":"send","params":)" + params + "}");
  };
  EXPECT_EQ(ask(R"({"text": "READ?"})")["error"]["message"], "send: a replay has no device");
  std::string sent;
  rpc_.send_by([&sent](std::size_t line, std::span<const std::uint8_t> bytes) -> Result<void> {
    sent += std::to_string(line) + ":" + std::string(bytes.begin(), bytes.end()) + ";";
    if (bytes.size() == 3) return make_error("tty", "no");
    return {};
  });
  EXPECT_EQ(ask(R"({"text": "READ?\r"})")["result"]["sent"], 6);
  EXPECT_EQ(ask(R"({"hex": "41 42"})")["result"]["sent"], 2);
  EXPECT_EQ(ask(R"({"text": "ABC"})")["error"]["message"], "tty: no");
  EXPECT_EQ(sent, "0:READ?\r;0:AB;0:ABC;");
  for (const char* wrong : {"{}", "[]", R"({"text": ""})", R"({"text": 1})", R"({"hex": "4"})",
                            R"({"text": "A", "hex": "41"})", R"({"text": "A", "line": "oven"})"}) {
    EXPECT_EQ(ask(wrong)["error"]["code"], kInvalidParams) << wrong;
  }
}

TEST_F(RpcTest, ASubscriberGetsItsRows) {
  parts_->publisher.add(asker_.client());
  asker_.result(rpc_, "subscribe", {{"streams", {"window"}}});
  begin_session();
  feed(4);
  const std::string text = asker_.read();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), parts_->publisher.history(0).size());
  EXPECT_EQ(text.find("\"sample\""), std::string::npos);
  asker_.result(rpc_, "unsubscribe");
  feed(4);
  EXPECT_EQ(asker_.read(), "");
}

// A client that sends requests without reading is closed; its responses do not fill the memory.
TEST_F(RpcTest, AClientThatNeverReadsIsClosed) {
  begin_session();
  feed(600);
  test::Asker deaf(1 << 16);
  for (int i = 0; i < 50 && deaf.client()->open(); ++i) {
    rpc_.request(deaf.client(),
                 R"({"jsonrpc":"2.0","id":1,"protocol":2,"method":"history","params":{"seconds":3600}})");
  }
  EXPECT_FALSE(deaf.client()->open());
}

}  // namespace
}  // namespace prism::socket
