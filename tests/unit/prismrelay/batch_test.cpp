// SPDX-License-Identifier: MIT
#include "tools/prismrelay/batch.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <utf8.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "tests/support/hostile_texts.hpp"
#include "tools/prismrelay/divided_commit.hpp"
#include "tools/prismrelay/state.hpp"

namespace prism::prismrelay {
namespace {

using nlohmann::json;
using testing::HasSubstr;

const std::string kLog(32, 'a');

json page_of(std::uint64_t missing = 0) {
  const json page = {{"log", kLog},
                     {"segments",
                      {{{"segment", 2},
                        {"file", "gyro1-1.csv"},
                        {"metadata", {{"model", "m1"}, {"note", std::string("a\0\"b", 4)}}},
                        {"columns", "time_s,samples"},
                        {"first", 5},
                        {"rows", {"10,7", "truncated", "86411,8"}}}}},
                     {"after", kLog + "-2-7-9"},
                     {"more", true},
                     {"missing", missing}};
  return json::parse(page.dump());  // unsigned numbers, as in a received page
}

struct BatchTest : testing::Test {
  Batch batch;
};

TEST_F(BatchTest, ConvertsAPageToRowsSegmentAndCursor) {
  const auto summary = batch.add_page({"lab/g", "z"}, "earliest", page_of());
  ASSERT_TRUE(summary) << summary.error().text();
  EXPECT_EQ(summary->cursor, kLog + "-2-7-9");
  EXPECT_EQ(summary->rows, 2u);
  EXPECT_EQ(summary->invalid, 1u);
  EXPECT_TRUE(summary->more);
  EXPECT_EQ(summary->arrival_s, 86411);
  EXPECT_EQ(batch.days(), (std::set<std::int64_t>{0, 1}));
  EXPECT_THAT(batch.text(Table::kRows), HasSubstr("\"lab/g\",\"z\"," + kLog + ",2,5,10,10,"));
  EXPECT_THAT(batch.text(Table::kRows), HasSubstr("," + kLog + ",2,7,86411,86411,"));
  EXPECT_EQ(batch.text(Table::kRefused),
            "\"lab/g\",\"z\"," + kLog + ",2,6,\"found 1 fields, expected 2\",\"truncated\"\n");
  EXPECT_EQ(batch.text(Table::kSegments),
            "\"lab/g\",\"z\"," + kLog +
                ",2,\"gyro1-1.csv\",\"m1\",\"{\"\"model\"\":\"\"m1\"\",\"\"note\"\":\"\"a\xef\xbf\xbd\\\"\"b\"\"}\"\n");
  EXPECT_EQ(batch.text(Table::kPlaces), "\"lab/g\",\"z\",\"" + kLog + "-2-7-9\"," + kLog + ",2,7,86411.000000,2\n");
  EXPECT_EQ(batch.text(Table::kGaps), "");
  ASSERT_EQ(batch.items().size(), 1u);
  EXPECT_EQ(batch.items()[0].cursor, kLog + "-2-7-9");
}

TEST_F(BatchTest, RecordsMissingRowsAsAGap) {
  ASSERT_TRUE(batch.add_page({"lab/g", "z"}, "c", page_of(41)));
  EXPECT_EQ(batch.text(Table::kGaps), "\"lab/g\",\"z\",deleted,\"c\",41\n");
  batch.add_change_of_log({"lab/h", "x"}, "d");
  EXPECT_THAT(batch.text(Table::kGaps), HasSubstr("\"lab/h\",\"x\",log_changed,\"d\",0\n"));
}

TEST_F(BatchTest, IsUnchangedByAnInvalidResponse) {
  const auto without = [](const char* key) {
    json page = page_of();
    page.erase(key);
    return page;
  };
  std::vector<json> invalid = {
      json(), json::array(), "text", without("log"), without("after"), without("segments"), without("missing")};
  invalid.push_back(page_of());
  invalid.back()["log"] = "'; DROP TABLE prism.rows";
  invalid.push_back(page_of());
  invalid.back()["segments"][0]["segment"] = -1;
  invalid.push_back(page_of());
  invalid.back()["segments"][0]["rows"][1] = 7;
  invalid.push_back(page_of());
  invalid.back()["segments"][0]["first"] = 1ULL << 40;
  for (const std::string& cursor : {std::string(), std::string(129, 'a'), std::string("a\nb")}) {
    invalid.push_back(page_of());
    invalid.back()["after"] = cursor;
  }
  for (const json& page : invalid) {
    batch = Batch();
    const auto summary = batch.add_page({"lab/g", "z"}, "c", page);
    EXPECT_FALSE(summary) << page;
    EXPECT_TRUE(batch.empty()) << page;
  }
}

TEST_F(BatchTest, DoesNotCutACharacterOfAnEvent) {
  batch.add_event("lab/g",
                  {{"time_s", 1.5}, {"severity", "info"}, {"kind", "note"}, {"text", std::string(999, 'a') + "µ"}});
  EXPECT_EQ(batch.text(Table::kEvents), "\"lab/g\",1.500000,\"info\",\"note\",\"" + std::string(999, 'a') + "\"\n");
  batch.add_event("lab/g", {{"time_s", "now"}});
  batch.add_event("lab/g", nullptr);
  const std::string events = batch.text(Table::kEvents);
  EXPECT_EQ(std::count(events.begin(), events.end(), '\n'), 1);
}

/// Parses CSV like PostgreSQL and returns the fields of each record.
std::vector<std::vector<std::string>> records_of(const std::string& csv) {
  std::vector<std::vector<std::string>> records(1, std::vector<std::string>(1));
  bool quoted = false;
  for (std::size_t i = 0; i < csv.size(); ++i) {
    std::string& field = records.back().back();
    const bool escaped_quote = quoted && csv.substr(i, 2) == "\"\"";
    if (escaped_quote) {
      field += csv[i++];
    } else if (csv[i] == '"') {
      quoted = !quoted;
    } else if (quoted) {
      field += csv[i];
    } else if (csv[i] == ',') {
      records.back().emplace_back();
    } else if (csv[i] == '\n') {
      records.emplace_back(1);
    } else {
      field += csv[i];
    }
  }
  EXPECT_FALSE(quoted);
  records.pop_back();  // after the last line end
  return records;
}

bool has_nul(const json& value) {
  if (value.is_string()) return value.get_ref<const std::string&>().find('\0') != std::string::npos;
  if (!value.is_structured()) return false;
  return std::any_of(value.begin(), value.end(), has_nul);
}

// One text that the server rejects would block the rows of all gyros.
TEST_F(BatchTest, IsAcceptedByTheServerForAnyText) {
  for (const std::string& text : test::hostile_texts()) {
    SCOPED_TRACE(text.substr(0, 40));
    json page = page_of();
    json& segment = page["segments"][0];
    segment["metadata"] = {{"model", text}, {"list", {text, {{"deep", text}}}}, {text, 1}, {"nan", std::nan("")}};
    segment["file"] = text;
    segment["rows"] = {text, "10,7"};
    batch = Batch();
    const auto summary = batch.add_page({"lab/g", "z"}, "c", page);
    ASSERT_TRUE(summary) << summary.error().text();
    EXPECT_EQ(summary->rows, 1u);
    batch.add_event("lab/g", {{"time_s", 1}, {"severity", text}, {"kind", text}, {"text", text}});
    constexpr std::pair<Table, std::size_t> kFields[] = {
        {Table::kRows, 26}, {Table::kSegments, 7}, {Table::kPlaces, 8}, {Table::kRefused, 7}, {Table::kEvents, 5}};
    for (const auto& [table, fields] : kFields) {
      const auto records = records_of(batch.text(table));
      ASSERT_EQ(records.size(), 1u) << "table " << static_cast<int>(table);
      EXPECT_EQ(records[0].size(), fields) << "table " << static_cast<int>(table);
      for (const std::string& field : records[0]) {
        EXPECT_TRUE(utf8::is_valid(field));
        EXPECT_EQ(field.find('\0'), std::string::npos);
      }
    }
    const json metadata = json::parse(records_of(batch.text(Table::kSegments))[0][6], nullptr, false);
    ASSERT_TRUE(metadata.is_object());
    EXPECT_FALSE(has_nul(metadata));
    for (const auto& [key, value] : metadata.items()) EXPECT_FALSE(has_nul(key));
    const bool storable = utf8::is_valid(text) && text.find('\0') == std::string::npos;
    if (storable) {
      EXPECT_EQ(metadata["model"], text);
    }
  }
}

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

TEST_F(BatchTest, NeedsOneTransactionWithoutABadRow) {
  for (const char* gyro : {"lab/a", "lab/b", "lab/c"}) ASSERT_TRUE(batch.add_page({gyro, "z"}, "c1", numbered_page(3)));
  FakeServer server;
  const auto refusals = divided_commit(batch, std::ref(server));
  ASSERT_TRUE(refusals);
  EXPECT_EQ(server.attempts, 1);
  EXPECT_EQ(server.lines(Table::kRows), 9);
  EXPECT_EQ(server.lines(Table::kPlaces), 3);
  for (const Refusal& refusal : *refusals) EXPECT_EQ(refusal.first + refusal.error, "");
}

TEST_F(BatchTest, StoresOnlyTheBadRowsInRefusedRows) {
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

TEST_F(BatchTest, EndsWithinItsAttempts) {
  for (const int rows : {50, 2000}) {
    batch = Batch();
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

TEST_F(BatchTest, StoresThePageIfOnlyItsMetadataAreBad) {
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

TEST_F(BatchTest, LeavesOutABadEvent) {
  for (const char* text : {"one", "two", "three"})
    batch.add_event("lab/g", {{"time_s", 1}, {"severity", "info"}, {"kind", "note"}, {"text", text}});
  FakeServer server{.bad = {"two"}};
  const auto refusals = divided_commit(batch, std::ref(server));
  ASSERT_TRUE(refusals);
  EXPECT_EQ(server.lines(Table::kEvents), 2);
  EXPECT_EQ((*refusals)[1].first, "an event: refused two");
  EXPECT_EQ((*refusals)[1].error, "");
}

TEST_F(BatchTest, ReportsACursorThatIsNotStored) {
  ASSERT_TRUE(batch.add_page({"lab/good", "z"}, "c1", numbered_page(3)));
  ASSERT_TRUE(batch.add_page({"lab/bad", "z"}, "c1", numbered_page(3)));
  FakeServer server{.bad = {"\"lab/bad\",\"z\",\"c2\""}};
  const auto refusals = divided_commit(batch, std::ref(server));
  ASSERT_TRUE(refusals);
  EXPECT_EQ((*refusals)[0].error, "");
  EXPECT_THAT((*refusals)[1].error, HasSubstr("refused"));
  EXPECT_THAT(server.text(Table::kPlaces), Not(HasSubstr("lab/bad")));
}

TEST_F(BatchTest, EndsWithTheErrorOfALostConnection) {
  ASSERT_TRUE(batch.add_page({"lab/g", "z"}, "c1", numbered_page(100)));
  for (std::size_t lost_after = 0; lost_after < 13; ++lost_after) {
    FakeServer server{.bad = {row_text(50)}, .lost_after = lost_after};
    const auto refusals = divided_commit(batch, std::ref(server));
    ASSERT_FALSE(refusals) << lost_after;
    EXPECT_EQ(refusals.error().what, "connection lost");
    EXPECT_EQ(server.attempts, static_cast<int>(lost_after) + 1);
  }
}

TEST_F(BatchTest, LimitsNumbersToThoseOfTheColumns) {
  ASSERT_TRUE(batch.add_page({"lab/g", "z"}, "c", numbered_page(1, UINT64_MAX)));
  EXPECT_EQ(batch.text(Table::kGaps), "\"lab/g\",\"z\",deleted,\"c\",9223372036854775807\n");
  json page = numbered_page(2);
  page["segments"][0]["first"] = INT32_MAX - 1U;
  EXPECT_FALSE(batch.add_page({"lab/g", "z"}, "c", page)) << "its second row has the number INT32_MAX + 1";
}

TEST(RelayState, LogsARepeatedErrorOnceWithItsCount) {
  RelayState state;
  testing::internal::CaptureStderr();
  for (int i = 0; i < 5; ++i) state.down("postgresql", "postgresql: no");
  state.down("postgresql", "postgresql: other");
  for (int i = 0; i < 3; ++i) state.down("postgresql", "postgresql: other");
  state.up("postgresql");
  state.up("postgresql");
  const std::string log = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(log.begin(), log.end(), '\n'), 3) << log;
  EXPECT_THAT(log, HasSubstr("postgresql: no; retrying\n"));
  EXPECT_THAT(log, HasSubstr("postgresql: other; retrying (the error before was repeated 4 times)\n"));
  EXPECT_THAT(log, HasSubstr("postgresql: connected; the last error was repeated 3 times\n"));
  EXPECT_EQ(state.view().targets.at("postgresql").failures, 9u);
}

}  // namespace
}  // namespace prism::prismrelay
