// SPDX-License-Identifier: MIT
// A follower between a prismd and a ledger that comes and goes: what it asks behind is what the ledger has, never more.
#include "tools/prismrelay/row_follower.hpp"

#include <gtest/gtest.h>

#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>

#include "tests/support/temporary_folder.hpp"

namespace prism::prismrelay {
namespace {

using boost::asio::local::stream_protocol;
using nlohmann::json;

/// The relay's side on one io_context, prismd's side played by hand.
struct RowFollowerTest : testing::Test {
  RowFollowerTest()
      : path(folder.file("gyro.sock")), acceptor(context, stream_protocol::endpoint(path)), prismd(context) {
    traffic.batch = &batch;
    traffic.state = &state;
    traffic.follower = "relay";
    traffic.gathered = [this] { ++gathered; };
    traffic.freed = [] {};
    traffic.open = true;
    follower = std::make_shared<RowFollower>(context, traffic, LogKey{"lab/g", "z"}, "");
    follower->open(path, [](const std::string&) {});
    acceptor.accept(prismd);
    context.poll();
  }
  /// The next question; the relay's side goes round until it is there.
  json question() {
    context.poll();
    const std::size_t size = boost::asio::read_until(prismd, boost::asio::dynamic_buffer(text), '\n');
    json request = json::parse(text.substr(0, size));
    text.erase(0, size);
    return request;
  }
  void answer(const json& request, const json& result) {
    const std::string line = json{{"jsonrpc", "2.0"}, {"id", request["id"]}, {"result", result}}.dump() + "\n";
    boost::asio::write(prismd, boost::asio::buffer(line));
    for (int i = 0; i < 100; ++i) context.poll();
  }
  json page(const std::string& after, int first) {
    return {{"log", std::string(32, 'a')},
            {"after", after},
            {"more", false},
            {"missing", 0U},
            {"segments",
             {{{"segment", 1U},
               {"file", "f"},
               {"metadata", json::object()},
               {"columns", "time_s"},
               {"first", static_cast<unsigned>(first)},
               {"rows", {"5"}}}}}};
  }

  test::TemporaryFolder folder;
  const std::string path;
  boost::asio::io_context context;
  stream_protocol::acceptor acceptor;
  stream_protocol::socket prismd;
  std::string text;
  Batch batch;
  RelayState state;
  RowTraffic traffic;
  std::shared_ptr<RowFollower> follower;
  int gathered = 0;
};

TEST_F(RowFollowerTest, AsksBehindWhatWasCommitted) {
  follower->go_on("");
  const json first = question();
  EXPECT_EQ(first["params"]["after"], "earliest");
  EXPECT_EQ(first["params"]["name"], "relay");
  answer(first, page("c1", 1));
  EXPECT_EQ(gathered, 1);
  EXPECT_FALSE(batch.empty());
  batch = {};
  follower->committed();
  EXPECT_EQ(question()["params"]["after"], "c1");
}

// The ledger went while prismd was asked: the page is nobody's, and the commit of another gyro's rows later is not its
// own.
TEST_F(RowFollowerTest, APageThatComesWhileTheLedgerIsAwayIsAskedForAgain) {
  follower->go_on("c1");
  const json request = question();
  traffic.open = false;
  follower->dropped();
  answer(request, page("c2", 2));
  EXPECT_TRUE(batch.empty());
  EXPECT_EQ(gathered, 0);
  traffic.open = true;
  follower->go_on("c1");
  EXPECT_EQ(question()["params"]["after"], "c1");
  follower->committed();
  follower->ask();
  context.poll();
  EXPECT_EQ(prismd.available(), 0u) << "one question at a time";
}

TEST_F(RowFollowerTest, WhatFailedToBeCommittedIsAskedForAgain) {
  follower->go_on("c1");
  answer(question(), page("c2", 2));
  EXPECT_EQ(gathered, 1);
  traffic.open = false;
  batch = {};
  follower->dropped();
  traffic.open = true;
  follower->go_on("c1");
  EXPECT_EQ(question()["params"]["after"], "c1");
}

TEST_F(RowFollowerTest, AnotherLogBeginsAtItsBeginning) {
  follower->go_on("c1");
  const json request = question();
  const std::string line = json{{"jsonrpc", "2.0"},
                                {"id", request["id"]},
                                {"error", {{"code", -32002}, {"message", "the cursor is of log x"}}}}
                               .dump() +
                           "\n";
  boost::asio::write(prismd, boost::asio::buffer(line));
  for (int i = 0; i < 100; ++i) context.poll();
  EXPECT_NE(batch.text(Batch::kGaps).find("log_changed"), std::string::npos);
  EXPECT_EQ(question()["params"]["after"], "earliest");
}

}  // namespace
}  // namespace prism::prismrelay
