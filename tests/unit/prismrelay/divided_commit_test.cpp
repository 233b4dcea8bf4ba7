// SPDX-License-Identifier: MIT
// divided_commit() with a server that refuses chosen rows: these, and only these, are in refused_rows.
#include "tools/prismrelay/divided_commit.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

namespace prism::prismrelay {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

const std::string kLogId(32, 'a');

// A page of rows whose `samples` are their numbers.
json numbered_page(int rows, std::uint64_t missing = 0) {
  std::vector<std::string> lines;
  for (int i = 1; i <= rows; ++i) lines.push_back(fmt::format("{},{}", 1000 + i, i));
  const json page = {{"log", kLogId},
                     {"segments",
                      {{{"segment", 1},
                        {"file", "f"},
                        {"metadata", {{"model", "m"}}},
                        {"columns", "time_s,samples"},
                        {"first", 1},
                        {"rows", lines}}}},
                     {"after", "c2"},
                     {"more", false},
                     {"missing", missing}};
  return json::parse(page.dump());
}

/// A server that refuses transactions with one of the texts `bad`, and stores the others.
struct FakeServer {
  std::vector<std::string> bad = {};
  CopyTexts stored = {};
  int attempts = 0;
  std::size_t lost_after = SIZE_MAX;  // attempts
  bool accepts_places = false;

  Result<std::optional<std::string>> operator()(const CopyTexts& texts) {
    if (++attempts > static_cast<int>(std::min<std::size_t>(lost_after, 1 << 20)))
      return make_error("postgresql", "connection lost");
    for (const std::string& one : bad) {
      for (std::size_t i = 0; i < kTables; ++i) {
        const Table table = static_cast<Table>(i);
        if (accepts_places && table == Table::kPlaces) continue;
        if (table != Table::kRefused && texts[i].find(one) != std::string::npos) return "refused " + one;
      }
    }
    for (std::size_t i = 0; i < kTables; ++i) stored[i] += texts[i];
    return std::nullopt;
  }
  const std::string& text(Table table) const { return stored[static_cast<std::size_t>(table)]; }
  long lines(Table table) const { return std::count(text(table).begin(), text(table).end(), '\n'); }
};

std::string row_text(int number) { return fmt::format(",,{},", number); }  // no sensors, samples

TEST(DividedCommit, NeedsOneTransactionWithoutABadRow) {
  Batch batch;
  for (const char* gyro : {"lab/a", "lab/b", "lab/c"}) ASSERT_TRUE(batch.add_page({gyro, "z"}, "c1", numbered_page(3)));
  FakeServer server;
  const auto refusals = divided_commit(batch, std::ref(server));
  ASSERT_TRUE(refusals);
  EXPECT_EQ(server.attempts, 1);
  EXPECT_EQ(server.lines(Table::kRows), 9);
  EXPECT_EQ(server.lines(Table::kPlaces), 3);
  for (const Refusal& refusal : *refusals) EXPECT_EQ(refusal.first + refusal.error, "");
}

TEST(DividedCommit, StoresOnlyTheBadRowsInRefusedRows) {
  Batch batch;
  for (int gyro = 0; gyro < 50; ++gyro)
    ASSERT_TRUE(batch.add_page({fmt::format("lab/g{}", gyro), "z"}, "c1", numbered_page(gyro == 30 ? 2000 : 40)));
  FakeServer server{.bad = {row_text(777), row_text(2000)}};
  const auto refusals = divided_commit(batch, std::ref(server));
  ASSERT_TRUE(refusals);
  EXPECT_EQ(server.lines(Table::kRows), 49 * 40 + 1998);
  EXPECT_EQ(server.text(Table::kRefused),
            fmt::format("\"lab/g30\",\"z\",{0},1,777,\"refused ,,777,\",\"1777,777\"\n"
                        "\"lab/g30\",\"z\",{0},1,2000,\"refused ,,2000,\",\"3000,2000\"\n",
                        kLogId));
  EXPECT_EQ(server.lines(Table::kPlaces), 50);
  EXPECT_THAT(server.text(Table::kPlaces),
              HasSubstr("\"lab/g30\",\"z\",\"c2\"," + kLogId + ",1,1999,2999.000000,1998\n"));
  EXPECT_EQ((*refusals)[30].rows, 2u);
  EXPECT_EQ((*refusals)[30].first, "row 777 of segment 1: refused ,,777,");
  EXPECT_EQ((*refusals)[30].error, "");
  EXPECT_EQ((*refusals)[29].first, "");
  EXPECT_LT(server.attempts, 2 * std::log2(50) + 2 * 2 * std::log2(2000) + 4);
}

TEST(DividedCommit, EndsWithinItsAttempts) {
  for (const int rows : {50, 2000}) {
    Batch batch;
    ASSERT_TRUE(batch.add_page({"lab/bad", "z"}, "c1", numbered_page(rows, 1)));
    ASSERT_TRUE(batch.add_page({"lab/good", "z"}, "c1", numbered_page(9)));
    FakeServer server{.bad = {"lab/bad\",\"z\"," + kLogId}};
    server.accepts_places = true;
    const auto refusals = divided_commit(batch, std::ref(server));
    ASSERT_TRUE(refusals);
    EXPECT_EQ((*refusals)[0].too_many, rows > 50);
    EXPECT_EQ((*refusals)[0].error.empty(), rows == 50);
    EXPECT_EQ((*refusals)[1].error, "");
    EXPECT_EQ(server.lines(Table::kRows), 9);
    EXPECT_EQ(server.lines(Table::kRefused), rows > 50 ? 0 : 51);
    EXPECT_LT(server.attempts, kMaxAttempts + 6);
  }
}

TEST(DividedCommit, StoresThePageIfOnlyItsMetadataAreBad) {
  Batch batch;
  ASSERT_TRUE(batch.add_page({"lab/g", "z"}, "c1", numbered_page(3)));
  FakeServer server{.bad = {"model"}};
  const auto refusals = divided_commit(batch, std::ref(server));
  ASSERT_TRUE(refusals);
  EXPECT_EQ(server.lines(Table::kRows), 3);
  EXPECT_EQ(server.lines(Table::kSegments), 0);
  EXPECT_THAT(server.text(Table::kRefused), HasSubstr(",1,0,\"refused model\","));
  EXPECT_EQ((*refusals)[0].rows, 0u);
  EXPECT_EQ((*refusals)[0].first, "metadata of segment 1: refused model");
}

TEST(DividedCommit, LeavesOutABadEvent) {
  Batch batch;
  for (const char* text : {"one", "two", "three"})
    batch.add_event("lab/g", {{"time_s", 1}, {"severity", "info"}, {"kind", "note"}, {"text", text}});
  FakeServer server{.bad = {"two"}};
  const auto refusals = divided_commit(batch, std::ref(server));
  ASSERT_TRUE(refusals);
  EXPECT_EQ(server.lines(Table::kEvents), 2);
  EXPECT_EQ((*refusals)[1].first, "an event: refused two");
  EXPECT_EQ((*refusals)[1].error, "");
}

TEST(DividedCommit, ReportsACursorThatIsNotStored) {
  Batch batch;
  ASSERT_TRUE(batch.add_page({"lab/good", "z"}, "c1", numbered_page(3)));
  ASSERT_TRUE(batch.add_page({"lab/bad", "z"}, "c1", numbered_page(3)));
  FakeServer server{.bad = {"\"lab/bad\",\"z\",\"c2\""}};
  const auto refusals = divided_commit(batch, std::ref(server));
  ASSERT_TRUE(refusals);
  EXPECT_EQ((*refusals)[0].error, "");
  EXPECT_THAT((*refusals)[1].error, HasSubstr("refused"));
  EXPECT_THAT(server.text(Table::kPlaces), Not(HasSubstr("lab/bad")));
}

TEST(DividedCommit, EndsWithTheErrorOfALostConnection) {
  Batch batch;
  ASSERT_TRUE(batch.add_page({"lab/g", "z"}, "c1", numbered_page(100)));
  for (std::size_t lost_after = 0; lost_after < 13; ++lost_after) {
    FakeServer server{.bad = {row_text(50)}, .lost_after = lost_after};
    const auto refusals = divided_commit(batch, std::ref(server));
    ASSERT_FALSE(refusals) << lost_after;
    EXPECT_EQ(refusals.error().what, "connection lost");
    EXPECT_EQ(server.attempts, static_cast<int>(lost_after) + 1);
  }
}

TEST(Batch, LimitsNumbersToThoseOfTheColumns) {
  Batch batch;
  ASSERT_TRUE(batch.add_page({"lab/g", "z"}, "c", numbered_page(1, UINT64_MAX)));
  EXPECT_EQ(batch.text(Table::kGaps), "\"lab/g\",\"z\",deleted,\"c\",9223372036854775807\n");
  json page = numbered_page(2);
  page["segments"][0]["first"] = INT32_MAX - 1U;
  EXPECT_FALSE(batch.add_page({"lab/g", "z"}, "c", page)) << "its second row has the number INT32_MAX + 1";
}

}  // namespace
}  // namespace prism::prismrelay
