// SPDX-License-Identifier: MIT
#include "tools/prismrelay/batch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <utf8.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/hostile_texts.hpp"

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

TEST(Batch, ConvertsAPageToRowsSegmentAndCursor) {
  Batch batch;
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

TEST(Batch, RecordsMissingRowsAsAGap) {
  Batch batch;
  ASSERT_TRUE(batch.add_page({"lab/g", "z"}, "c", page_of(41)));
  EXPECT_EQ(batch.text(Table::kGaps), "\"lab/g\",\"z\",deleted,\"c\",41\n");
  batch.add_change_of_log({"lab/h", "x"}, "d");
  EXPECT_THAT(batch.text(Table::kGaps), HasSubstr("\"lab/h\",\"x\",log_changed,\"d\",0\n"));
}

TEST(Batch, IsUnchangedByAnInvalidResponse) {
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
    Batch batch;
    const auto summary = batch.add_page({"lab/g", "z"}, "c", page);
    EXPECT_FALSE(summary) << page;
    EXPECT_TRUE(batch.empty()) << page;
  }
}

TEST(Batch, DoesNotCutACharacterOfAnEvent) {
  Batch batch;
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
TEST(Batch, IsAcceptedByTheServerForAnyText) {
  for (const std::string& text : test::hostile_texts()) {
    SCOPED_TRACE(text.substr(0, 40));
    json page = page_of();
    json& segment = page["segments"][0];
    segment["metadata"] = {{"model", text}, {"list", {text, {{"deep", text}}}}, {text, 1}, {"nan", std::nan("")}};
    segment["file"] = text;
    segment["rows"] = {text, "10,7"};
    Batch batch;
    const auto summary = batch.add_page({"lab/g", "z"}, "c", page);
    ASSERT_TRUE(summary) << summary.error().text();
    EXPECT_EQ(summary->rows, 1u);
    batch.add_event("lab/g", {{"time_s", 1}, {"severity", text}, {"kind", text}, {"text", text}});
    constexpr std::pair<Table, std::size_t> kFields[] = {
        {Table::kRows, 25}, {Table::kSegments, 7}, {Table::kPlaces, 8}, {Table::kRefused, 7}, {Table::kEvents, 5}};
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

}  // namespace
}  // namespace prism::prismrelay
