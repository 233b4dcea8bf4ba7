// SPDX-License-Identifier: MIT
// A follower between a prismd and a ledger that comes and goes: what it asks behind is what the ledger has, never more.
#include "tools/prismrelay/log_tailer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>

#include "tests/support/temporary_folder.hpp"
#include "tools/prismrelay/report.hpp"

namespace prism::prismrelay {
namespace {

using boost::asio::local::stream_protocol;
using nlohmann::json;

/// The relay's side on one io_context, prismd's side played by hand.
struct LogTailerTest : testing::Test {
  LogTailerTest()
      : path(folder.file("gyro.sock")), acceptor(context, stream_protocol::endpoint(path)), prismd(context) {
    traffic.batch = &batch;
    traffic.state = &state;
    traffic.follower = "relay";
    traffic.gathered = [this] { ++gathered; };
    traffic.freed = [] {};
    traffic.open = true;
    follower = std::make_shared<LogTailer>(context, traffic, LogKey{"lab/g", "z"}, "");
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
  std::shared_ptr<LogTailer> follower;
  int gathered = 0;
};

TEST_F(LogTailerTest, AsksBehindWhatWasCommitted) {
  follower->resume("");
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
TEST_F(LogTailerTest, APageThatComesWhileTheLedgerIsAwayIsAskedForAgain) {
  follower->resume("c1");
  const json request = question();
  traffic.open = false;
  follower->dropped();
  answer(request, page("c2", 2));
  EXPECT_TRUE(batch.empty());
  EXPECT_EQ(gathered, 0);
  traffic.open = true;
  follower->resume("c1");
  EXPECT_EQ(question()["params"]["after"], "c1");
  follower->committed();
  follower->ask();
  context.poll();
  EXPECT_EQ(prismd.available(), 0u) << "one question at a time";
}

TEST_F(LogTailerTest, WhatFailedToBeCommittedIsAskedForAgain) {
  follower->resume("c1");
  answer(question(), page("c2", 2));
  EXPECT_EQ(gathered, 1);
  traffic.open = false;
  batch = {};
  follower->dropped();
  traffic.open = true;
  follower->resume("c1");
  EXPECT_EQ(question()["params"]["after"], "c1");
}

TEST_F(LogTailerTest, AnotherLogBeginsAtItsBeginning) {
  follower->resume("c1");
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

// The columns of a log that were cut in two by a line end in a name: no line fits them. The log was reported as
// carried.
TEST_F(LogTailerTest, ALogWithoutAReadableRowIsAnErrorUntilARowIsCarried) {
  const auto log = [this] { return state.view().logs.at({"lab/g", "z"}); };
  follower->resume("c1");
  json unreadable = page("c2", 1);
  unreadable["segments"][0]["columns"] = "\033[2J";
  answer(question(), unreadable);
  EXPECT_EQ(gathered, 1);
  follower->committed();
  EXPECT_EQ(log().refused, 1u);
  EXPECT_EQ(log().fault(), "no line of the log is a row: row 1 of segment 1: time_s: found \"\"");
  json end = page("c2", 2);
  end["segments"] = json::array();
  answer(question(), end);
  EXPECT_NE(log().fault(), "") << "the end of the log is no row";
  const json status = status_json({}, state.view());
  EXPECT_EQ(status["logs"][0]["caught_up"], false);
  EXPECT_THAT(status_view(status, host_time_s()),
              testing::HasSubstr("no row is carried now, 1 lines are no rows: no line"));
  answer(question(), page("c3", 2));
  follower->committed();
  EXPECT_EQ(log().fault(), "");
  EXPECT_THAT(status_view(status_json({}, state.view()), host_time_s()), testing::HasSubstr("1 rows, all there"));
}

// Members of another type than expected ended the relay.
TEST_F(LogTailerTest, AnswersOfAnyTypeAreAnErrorOfThisLog) {
  follower->resume("c1");
  const std::vector<json> results = {nullptr,
                                     5,
                                     "text",
                                     json::array({1}),
                                     {{"segments", json::array()}, {"missing", "0"}},
                                     {{"segments", json::array()}, {"missing", 0}, {"more", 3}}};
  const auto begun = state.view().logs.size();
  EXPECT_EQ(begun, 0u);
  answer(question(), results[0]);
  EXPECT_NE(state.view().logs.at({"lab/g", "z"}).fault(), "");
  for (const json& result : results) {
    Batch other;
    EXPECT_FALSE(other.add_page({"lab/g", "z"}, "c", result));
  }
}

TEST_F(LogTailerTest, AnErrorOfAnyTypeIsShownAsPrintable) {
  follower->resume("c1");
  const json request = question();
  const json error = {{"code", {1}}, {"message", "\033[2Jgone\n"}};
  const std::string line = json{{"jsonrpc", "2.0"}, {"id", request["id"]}, {"error", error}}.dump() + "\n";
  boost::asio::write(prismd, boost::asio::buffer(line));
  for (int i = 0; i < 100; ++i) context.poll();
  EXPECT_EQ(state.view().logs.at({"lab/g", "z"}).fault(), "\\x1b[2Jgone\\x0a");
}

TEST_F(LogTailerTest, ALineNestedAMillionDeepEndsTheConnectionAlone) {
  follower->resume("c1");
  (void)question();
  const std::string line = std::string(1 << 20, '[') + "\n";
  boost::system::error_code error;
  prismd.non_blocking(true);
  for (std::size_t sent = 0; sent < line.size() && !error;) {
    const std::size_t now = prismd.write_some(boost::asio::buffer(line.data() + sent, line.size() - sent), error);
    sent += now;
    if (error == boost::asio::error::would_block) error = {};
    context.poll();
  }
  for (int i = 0; i < 100; ++i) context.poll();
  char byte = 0;
  (void)prismd.read_some(boost::asio::buffer(&byte, 1), error);
  EXPECT_TRUE(error && error != boost::asio::error::would_block) << error.message();
}

}  // namespace
}  // namespace prism::prismrelay
