// SPDX-License-Identifier: MIT
// A LogTailer with a fake prismd and a database that is lost at times: it only requests rows after the committed
// cursor.
#include "tools/prismrelay/log_tailer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <nlohmann/json.hpp>

#include "tests/support/temporary_folder.hpp"
#include "tools/prismrelay/report.hpp"

namespace prism::prismrelay {
namespace {

using boost::asio::local::stream_protocol;
using nlohmann::json;

/// The relay runs on `context`; the tests send the responses of prismd.
struct LogTailerTest : testing::Test {
  LogTailerTest()
      : path(folder.file("gyro.sock")), acceptor(context, stream_protocol::endpoint(path)), prismd(context) {
    traffic.batch = &batch;
    traffic.state = &state;
    traffic.batch_extended = [this] { ++batch_extensions; };
    traffic.slot_released = [] {};
    traffic.database_up = true;
    tailer = std::make_shared<LogTailer>(context, traffic, LogKey{"lab/g", "z"});
    tailer->open(path, [](const std::string&) {});
    acceptor.accept(prismd);
    context.poll();
  }
  /// Returns the next request of the relay.
  json next_request() {
    context.poll();
    const std::size_t size = boost::asio::read_until(prismd, boost::asio::dynamic_buffer(text), '\n');
    json request = json::parse(text.substr(0, size));
    text.erase(0, size);
    return request;
  }
  void respond(const json& request, const json& page) {
    const json result = {{"axes", {{"z", page}}}};
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
  std::shared_ptr<LogTailer> tailer;
  int batch_extensions = 0;
};

TEST_F(LogTailerTest, RequestsRowsAfterTheCommittedCursor) {
  tailer->resume("");
  const json first = next_request();
  EXPECT_EQ(first["params"]["after"], "earliest");
  respond(first, page("c1", 1));
  EXPECT_EQ(batch_extensions, 1);
  EXPECT_FALSE(batch.empty());
  batch = {};
  tailer->committed();
  EXPECT_EQ(next_request()["params"]["after"], "c1");
}

// The database was lost during the request: the page is discarded, and a later commit of another gyro has no effect on
// it.
TEST_F(LogTailerTest, RequestsAPageAgainIfTheDatabaseIsDown) {
  tailer->resume("c1");
  const json request = next_request();
  traffic.database_up = false;
  tailer->discarded();
  respond(request, page("c2", 2));
  EXPECT_TRUE(batch.empty());
  EXPECT_EQ(batch_extensions, 0);
  traffic.database_up = true;
  tailer->resume("c1");
  EXPECT_EQ(next_request()["params"]["after"], "c1");
  tailer->committed();
  tailer->request_page();
  context.poll();
  EXPECT_EQ(prismd.available(), 0u) << "one request at a time";
}

TEST_F(LogTailerTest, WarnsAtHalfOfTheRetentionWhileTheDatabaseIsDown) {
  traffic.database_up = false;
  tailer->resume("c1");
  testing::internal::CaptureStderr();
  for (const unsigned behind : {50U, 51U, 52U, 10U}) {
    tailer->check_retention();
    const json request = next_request();
    EXPECT_EQ(request["params"]["after"], "c1");
    json answer = page("c2", 2);
    answer.update({{"behind", behind}, {"kept", 100U}, {"deleted", 7U}});
    respond(request, answer);
  }
  EXPECT_TRUE(batch.empty());
  const std::string told = testing::internal::GetCapturedStderr();
  EXPECT_THAT(told, testing::HasSubstr("lab/g z: 51 rows behind, more than half of those that prismd keeps"));
  EXPECT_THAT(told, testing::HasSubstr("lab/g z: less than half of the kept rows behind again"));
  EXPECT_EQ(std::count(told.begin(), told.end(), '\n'), 2);
}

TEST_F(LogTailerTest, RequestsSmallPagesAfterManyRefusedRows) {
  tailer->resume("c1");
  const auto answer = [&](const char* cursor, const Refusal& refusal) {
    const json request = next_request();
    json large = page(cursor, 2);
    large["more"] = true;
    respond(request, large);
    batch = {};
    tailer->committed(refusal);
    return std::to_string(request["params"]["limit"].get<int>()) + " after " +
           request["params"]["after"].get<std::string>();
  };
  EXPECT_EQ(answer("c2", {0, "row 1", "too many", true}), "2000 after c1");
  EXPECT_EQ(answer("c2", {1, "row 1", "", false}), "50 after c1") << "the same rows";
  EXPECT_EQ(state.view().logs.at({"lab/g", "z"}).invalid, 1u);
  EXPECT_EQ(answer("c3", {}), "50 after c2");
  EXPECT_EQ(answer("c4", {0, "row 1", "refused", false}), "2000 after c3");
  EXPECT_EQ(state.view().logs.at({"lab/g", "z"}).fault(), "PostgreSQL refused the cursor: refused");
}

TEST_F(LogTailerTest, RequestsAPageAgainAfterAFailedCommit) {
  tailer->resume("c1");
  respond(next_request(), page("c2", 2));
  EXPECT_EQ(batch_extensions, 1);
  traffic.database_up = false;
  batch = {};
  tailer->discarded();
  traffic.database_up = true;
  tailer->resume("c1");
  EXPECT_EQ(next_request()["params"]["after"], "c1");
}

// Regression: the database was replaced by an older copy during a request. The response was added after the older
// cursor, so the rows between the two were skipped without a gap.
TEST_F(LogTailerTest, IgnoresTheResponseToARequestBeforeResume) {
  tailer->resume("c5");
  const json before = next_request();
  EXPECT_EQ(before["params"]["after"], "c5");
  tailer->discarded();
  tailer->resume("c1");
  respond(before, page("c6", 6));
  ASSERT_TRUE(batch.empty());
  EXPECT_EQ(batch_extensions, 0);
  const json request = next_request();
  EXPECT_EQ(request["params"]["after"], "c1");
  respond(request, page("c2", 2));
  EXPECT_EQ(batch_extensions, 1);
  EXPECT_EQ(traffic.large, 1);
}

TEST_F(LogTailerTest, ReadsANewLogFromItsStart) {
  tailer->resume("c1");
  const json request = next_request();
  const std::string line = json{{"jsonrpc", "2.0"},
                                {"id", request["id"]},
                                {"error", {{"code", -32002}, {"message", "the cursor is of log x"}}}}
                               .dump() +
                           "\n";
  boost::asio::write(prismd, boost::asio::buffer(line));
  for (int i = 0; i < 100; ++i) context.poll();
  EXPECT_NE(batch.text(Table::kGaps).find("log_changed"), std::string::npos);
  EXPECT_EQ(next_request()["params"]["after"], "earliest");
}

// Regression: a line end in a column name split the header line, so no row was valid, but the log was reported as up to
// date.
TEST_F(LogTailerTest, ReportsALogWithoutAValidRowUntilARowIsSent) {
  const auto log = [this] { return state.view().logs.at({"lab/g", "z"}); };
  tailer->resume("c1");
  json unreadable = page("c2", 1);
  unreadable["segments"][0]["columns"] = "\033[2J";
  respond(next_request(), unreadable);
  EXPECT_EQ(batch_extensions, 1);
  tailer->committed();
  EXPECT_EQ(log().invalid, 1u);
  EXPECT_EQ(log().fault(), "no valid row; last error: row 1 of segment 1: time_s: found \"\"");
  json end = page("c2", 2);
  end["segments"] = json::array();
  respond(next_request(), end);
  EXPECT_NE(log().fault(), "") << "an empty page does not clear the error";
  const json status = status_json({}, state.view());
  EXPECT_EQ(status["logs"][0]["caught_up"], false);
  EXPECT_THAT(status_view(status, host_time_s()),
              testing::HasSubstr("not sending, 1 invalid line: no valid row; last error: "));
  respond(next_request(), page("c3", 2));
  tailer->committed();
  EXPECT_EQ(log().fault(), "");
  EXPECT_THAT(status_view(status_json({}, state.view()), host_time_s()), testing::HasSubstr("1 rows, up to date"));
}

// Rows that a damaged segment lost, and no row after them yet: the gap is sent, and the next request is after it.
TEST_F(LogTailerTest, ContinuesAfterAGapWithoutRows) {
  tailer->resume("c1");
  json gap = page("c2", 1);
  gap["segments"] = json::array();
  gap["missing"] = 7U;
  respond(next_request(), gap);
  EXPECT_EQ(batch_extensions, 1);
  EXPECT_NE(batch.text(Table::kGaps).find(",7\n"), std::string::npos);
  tailer->committed();
  const json request = next_request();
  EXPECT_EQ(request["params"]["after"], "c2");
  respond(request, page("c3", 2));
  tailer->committed();
  EXPECT_EQ(state.view().logs.at({"lab/g", "z"}).missing, 7u);
  EXPECT_EQ(next_request()["params"]["after"], "c3");
}

// Regression: members of an unexpected type ended the relay.
TEST_F(LogTailerTest, ReportsAResponseOfAnyTypeAsAnErrorOfTheLog) {
  tailer->resume("c1");
  const std::vector<json> results = {nullptr,
                                     5,
                                     "text",
                                     json::array({1}),
                                     {{"segments", json::array()}, {"missing", "0"}},
                                     {{"segments", json::array()}, {"missing", 0}, {"more", 3}}};
  EXPECT_EQ(state.view().logs.size(), 0u);
  respond(next_request(), results[0]);
  EXPECT_NE(state.view().logs.at({"lab/g", "z"}).fault(), "");
  for (const json& result : results) {
    Batch other;
    EXPECT_FALSE(other.add_page({"lab/g", "z"}, "c", result));
  }
}

TEST_F(LogTailerTest, MakesErrorsPrintable) {
  tailer->resume("c1");
  const json request = next_request();
  const json error = {{"code", {1}}, {"message", "\033[2Jgone\n"}};
  const std::string line = json{{"jsonrpc", "2.0"}, {"id", request["id"]}, {"error", error}}.dump() + "\n";
  boost::asio::write(prismd, boost::asio::buffer(line));
  for (int i = 0; i < 100; ++i) context.poll();
  EXPECT_EQ(state.view().logs.at({"lab/g", "z"}).fault(), "\\x1b[2Jgone\\x0a");
}

TEST_F(LogTailerTest, ClosesTheConnectionAfterADeeplyNestedLine) {
  tailer->resume("c1");
  (void)next_request();
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
