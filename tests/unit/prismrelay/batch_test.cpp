// SPDX-License-Identifier: MIT
// Responses of prismd are converted to records of COPY; the expected ones are written by hand.
#include "tools/prismrelay/batch.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <utf8.h>

#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "compensation/compensated_text.hpp"
#include "tests/support/generated.hpp"
#include "tests/support/hostile_texts.hpp"

namespace prism::prismrelay {
namespace {

using nlohmann::json;
using testing::HasSubstr;

const std::string kLog(32, 'a');
const LogKey kKey = {"lab/g", "z"};
const std::string kKeyFields = "|lab/g|z|aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa|2|";

constexpr const char* kColumns =
    "time_utc,time_s,samples,missing,rate_deg_per_h,temperature_degc,uhfo_v,status,mean_rate_deg_per_h,mean_"
    "temperature_degc,"
    "slope_degc_per_s,mean_uhfo_v,bias_deg_per_h,sd_deg_per_h,corrected_deg_per_h,corrected_mean_deg_per_h,quality";

/// Records of prism.rows in COPY's binary format, a line each: its fields after a |; of a null nothing. Bytes of texts
/// that are not printable are in hexadecimal.
std::string shown(std::string_view records) {
  constexpr std::string_view kTypes = "tttiiiitiirrrirrrrrrrrtrrri";  // text, integer or real
  const auto number = [&](std::size_t size) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i)
      value |= std::uint64_t{static_cast<unsigned char>(records.at(i))} << (56 - 8 * i);
    records.remove_prefix(size);
    return static_cast<std::int64_t>(value) >> (64 - 8 * size);
  };
  std::string text;
  while (!records.empty()) {
    EXPECT_EQ(number(2), 27);
    for (const char type : kTypes) {
      const std::int64_t size = number(4);
      text += '|';
      if (size < 0) continue;
      if (type == 'i') text += fmt::format("{}", number(static_cast<std::size_t>(size)));
      if (type == 'r') text += fmt::format("{}", std::bit_cast<double>(number(8)));
      if (type != 't') continue;
      for (const char c : records.substr(0, static_cast<std::size_t>(size)))
        text += c >= ' ' && c <= '~' ? std::string(1, c) : fmt::format("{:02x}", static_cast<unsigned char>(c));
      records.remove_prefix(static_cast<std::size_t>(size));
    }
    text += '\n';
  }
  return text;
}

/// A row of kColumns.
std::string row_of(const std::string& time_s, int samples) {
  return fmt::format("x,{},{},0,,,,0,,,,,,,,,warming", time_s, samples);
}

json segment_of(const std::string& columns, const std::vector<std::string>& rows) {
  return {{"segment", 2},
          {"file", "gyro1-1.fields"},
          {"metadata", {{"model", "m1"}, {"note", std::string("a\0\"b", 4)}}},
          {"columns", columns},
          {"first", 5},
          {"rows", rows}};
}

json page_of(std::uint64_t missing = 0) {
  return {{"log", kLog},
          {"segments", {segment_of(kColumns, {row_of("10", 7), "truncated", row_of("86411", 8)})}},
          {"after", kLog + "-2-7-9"},
          {"more", true},
          {"missing", missing}};
}

Result<std::shared_ptr<BatchItem>> item_of(const json& page) {
  const json response = {{"axes", {{"z", page}}}};
  return page_item(kKey, "c",
                   json::parse(response.dump(-1, ' ', false, json::error_handler_t::replace)));  // unsigned numbers
}

TEST(Batch, ConvertsAPageToRowsSegmentAndCursor) {
  const auto item = item_of(page_of());
  ASSERT_TRUE(item) << item.error().text();
  BatchItem& page = **item;
  EXPECT_EQ(page.cursor, kLog + "-2-7-9");
  EXPECT_EQ(page.records[kRows].size(), 2u);
  EXPECT_EQ(page.invalid, 1u);
  EXPECT_EQ(page.error, "row 6 of segment 2: found 1 columns, expected 17");
  EXPECT_TRUE(page.more);
  EXPECT_EQ(page.days, (std::set<std::int64_t>{0, 1}));
  EXPECT_EQ(shown(page.texts[kRows]),
            kKeyFields + "5|-946684790000000|-946684790000000||7|0||||0|||||||||warming||||\n" + kKeyFields +
                "7|-946598389000000|-946598389000000||8|0||||0|||||||||warming||||\n");
  EXPECT_EQ(page.texts[kRefused], "\"lab/g\",\"z\"," + kLog + ",2,6,\"found 1 columns, expected 17\",\"truncated\"\n");
  EXPECT_EQ(
      page.texts[kSegments],
      "\"lab/g\",\"z\"," + kLog +
          ",2,\"gyro1-1.fields\",\"m1\",\"{\"\"model\"\":\"\"m1\"\",\"\"note\"\":\"\"a\xef\xbf\xbd\\\"\"b\"\"}\"\n");
  EXPECT_EQ(place_line(page),
            "\"lab/g\",\"z\",\"" + kLog + "-2-7-9\"," + kLog + ",2,7,1970-01-02T00:00:11.000000000Z,2\n");
  EXPECT_EQ(page.texts[kGaps], "");
}

TEST(Batch, PlacesTheCursorAfterTheLastStoredRow) {
  const auto item = item_of(page_of());
  BatchItem& page = **item;
  page.refuse(kRows, page.records[kRows][1], "no");
  EXPECT_TRUE(page.records[kRows][1].is_refused);
  EXPECT_EQ(page.refusal, "row 7 of segment 2: no");
  EXPECT_EQ(place_line(page),
            "\"lab/g\",\"z\",\"" + kLog + "-2-7-9\"," + kLog + ",2,5,1970-01-01T00:00:10.000000000Z,1\n");
  EXPECT_THAT(page.texts[kRefused], HasSubstr(",2,7,\"no\",\"" + row_of("86411", 8) + "\"\n"));
  page.refuse(kRows, page.records[kRows][0], "no");
  EXPECT_EQ(place_line(page), "\"lab/g\",\"z\",\"" + kLog + "-2-7-9\",,,,,0\n");
}

TEST(Batch, RecordsMissingRowsAsAGap) {
  EXPECT_EQ((*item_of(page_of(41)))->texts[kGaps], "\"lab/g\",\"z\",deleted,\"c\",41\n");
  EXPECT_EQ((*item_of(page_of(UINT64_MAX)))->texts[kGaps], "\"lab/g\",\"z\",deleted,\"c\",9223372036854775807\n");
  EXPECT_EQ(change_item({"lab/h", "x"}, "d")->texts[kGaps], "\"lab/h\",\"x\",log_changed,\"d\",0\n");
  json gap = page_of(7);
  gap["segments"] = json::array();
  EXPECT_FALSE((*item_of(gap))->is_empty());
  gap["missing"] = 0;
  EXPECT_TRUE((*item_of(gap))->is_empty());
}

// Regression: members of an unexpected type ended the relay.
TEST(Batch, RejectsAnInvalidResponse) {
  const auto without = [](const char* key) {
    json page = page_of();
    page.erase(key);
    return page;
  };
  std::vector<json> invalid = {
      json(), json::array(), "text", 5, without("log"), without("after"), without("segments"), without("missing")};
  const auto changed = [&](const char* pointer, const json& value) {
    invalid.push_back(page_of());
    invalid.back()[json::json_pointer(pointer)] = value;
  };
  changed("/log", "'; DROP TABLE prism.rows");
  changed("/more", 3);
  changed("/missing", "0");
  changed("/segments/0/segment", -1);
  changed("/segments/0/rows/1", 7);
  changed("/segments/0/first", 1ULL << 40);
  changed("/segments/0/first", INT32_MAX - 1U);  // its third row has the number INT32_MAX + 1
  for (const std::string& cursor : {std::string(), std::string(129, 'a'), std::string("a\nb")})
    changed("/after", cursor);
  for (const json& page : invalid) EXPECT_FALSE(item_of(page)) << page;
}

TEST(Batch, DoesNotCutACharacterOfAnEvent) {
  const auto item = event_item(
      "lab/g", {{"time_s", 1.5}, {"severity", "info"}, {"kind", "note"}, {"text", std::string(999, 'a') + "µ"}});
  EXPECT_EQ(item->texts[kEvents],
            "\"lab/g\",1970-01-01T00:00:01.500000000Z,\"info\",\"note\",\"" + std::string(999, 'a') + "\"\n");
  EXPECT_FALSE(event_item("lab/g", {{"time_s", "now"}}));
  EXPECT_FALSE(event_item("lab/g", nullptr));
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

// As in a received page.
json unsigned_numbers(const json& page) {
  json copy = page;
  for (json& segment : copy["segments"]) segment["segment"] = 2U, segment["first"] = 5U;
  copy["missing"] = 0U;
  return copy;
}

bool has_nul(const json& value) {
  if (value.is_string()) return value.get_ref<const std::string&>().find('\0') != std::string::npos;
  if (!value.is_structured()) return false;
  return std::any_of(value.begin(), value.end(), has_nul);
}

// One text that the server rejects would delay the rows of all gyros.
TEST(Batch, IsAcceptedByTheServerForAnyText) {
  for (const std::string& text : test::hostile_texts()) {
    SCOPED_TRACE(text.substr(0, 40));
    json page = page_of();
    json& segment = page["segments"][0];
    segment["metadata"] = {{"model", text}, {"list", {text, {{"deep", text}}}}, {text, 1}, {"nan", std::nan("")}};
    segment["file"] = text;
    segment["rows"] = {text, row_of("10", 7)};
    const auto item = page_item(kKey, "c", json{{"axes", {{"z", unsigned_numbers(page)}}}});
    ASSERT_TRUE(item) << item.error().text();
    EXPECT_EQ((*item)->records[kRows].size(), 1u);
    const auto event = event_item("lab/g", {{"time_s", 1}, {"severity", text}, {"kind", text}, {"text", text}});
    const std::pair<std::string, std::size_t> lines[] = {{(*item)->texts[kSegments], 7},
                                                         {(*item)->texts[kRefused], 7},
                                                         {place_line(**item), 8},
                                                         {event->texts[kEvents], 5}};
    for (const auto& [csv, fields] : lines) {
      const auto records = records_of(csv);
      ASSERT_EQ(records.size(), 1u) << csv;
      EXPECT_EQ(records[0].size(), fields) << csv;
      for (const std::string& field : records[0]) {
        EXPECT_TRUE(utf8::is_valid(field));
        EXPECT_EQ(field.find('\0'), std::string::npos);
      }
    }
    const json metadata = json::parse(records_of((*item)->texts[kSegments])[0][6], nullptr, false);
    ASSERT_TRUE(metadata.is_object());
    EXPECT_FALSE(has_nul(metadata));
    for (const auto& [key, value] : metadata.items()) EXPECT_FALSE(has_nul(key));
    const bool storable = utf8::is_valid(text) && text.find('\0') == std::string::npos;
    if (storable) {
      EXPECT_EQ(metadata["model"], text);
    }
  }
}

const std::string kAllColumns =
    std::string(kColumns) +
    ",sd_mean_deg_per_h,arrival_s,sent_deg_per_h,offset_deg_per_h,case_degc,chamber.air_degc,partial";
constexpr const char* kRow =
    "2026-11-23T09:11:01Z,1795425061,199,1,8.465401,25.01310,5.251000,0,8.465252,25.01250,0.00001000,5.250500,-0."
    "000125,"
    "0.008400,8.465526,8.465377,good,,1795425061.004,,,24.5,,0";

struct Converted {
  std::string error, fields;
  std::int64_t day = 0, arrival_ns = 0;
};

Converted convert(const std::string& columns, const std::string& line) {
  json page = page_of();
  page["segments"] = {segment_of(columns, {line})};
  if (columns.find(",case_degc,") != std::string::npos)
    page["segments"][0]["metadata"]["sensors"] = "case_degc chamber.air_degc";
  const auto item = page_item(kKey, "c", json{{"axes", {{"z", unsigned_numbers(page)}}}});
  Converted row;
  const std::string prefix = "row 5 of segment 2: ", key = kKeyFields + "5|";
  if (!(*item)->error.empty()) row.error = (*item)->error.substr(prefix.size());
  if ((*item)->records[kRows].empty()) return row;
  row.fields = shown((*item)->texts[kRows]).substr(key.size());
  row.day = *(*item)->days.begin();
  row.arrival_ns = (*item)->records[kRows][0].arrival_ns;
  return row;
}

TEST(RowConverter, IdentifiesColumnsByName) {
  const Converted row = convert(kAllColumns, kRow);
  EXPECT_EQ(row.error, "");
  EXPECT_EQ(row.fields,
            "848740261004000|848740261000000|01{\"case_degc\":24.5}|199|1|8.465401|25.0131|5.251|0|8.465252|25.0125|1e-"
            "05|5.2505|"
            "-0.000125|0.0084|8.465526|8.465377|good||||0\n");
  EXPECT_EQ(row.day, 20780);  // 2026-11-23
  EXPECT_EQ(row.arrival_ns, 1'795'425'061'004'000'000);
}

TEST(RowConverter, UsesTheTimeOfALogWithoutArrivals) {
  const Converted row = convert(kColumns, row_of("86400", 5));
  EXPECT_EQ(row.fields, "-946598400000000|-946598400000000||5|0||||0|||||||||warming||||\n");
  EXPECT_EQ(row.day, 1);
}

TEST(RowConverter, SkipsUnknownColumns) {
  EXPECT_EQ(convert(std::string("unknown,T_degc,") + kColumns, "abc,d," + row_of("5", 6)).fields,
            convert(kColumns, row_of("5", 6)).fields);
}

TEST(RowConverter, RefusesALineThatIsNotARow) {
  const auto error = [](const std::string& field, const std::string& value) {
    std::string columns = kAllColumns, line = kRow;
    std::size_t begin = 0;
    const auto before = std::count(columns.begin(), columns.begin() + columns.find(field + ","), ',');
    for (int i = 0; i < before; ++i) begin = line.find(',', begin) + 1;
    line.replace(begin, line.find(',', begin) - begin, value);
    const Converted bad = convert(columns, line);
    EXPECT_EQ(bad.fields, "") << line;
    return bad.error;
  };
  EXPECT_THAT(error("uhfo_v", "nan"), HasSubstr("uhfo_v: found \"nan\""));
  for (const char* value : {"1e999", "0x10", " 1"}) EXPECT_NE(error("uhfo_v", value), "");
  EXPECT_NE(error("samples", "4294967296"), "");
  EXPECT_EQ(error("samples", "2147483648"), "found 2147483648 samples, expected at most 2147483647");
  EXPECT_NE(error("status", "9223372036854775808"), "");
  EXPECT_NE(error("quality", "a\"b"), "");
  EXPECT_NE(error("quality", std::string("a\0b", 3)), "");
  EXPECT_NE(error("arrival_s", "-1"), "");
  EXPECT_NE(error("arrival_s", "1e12"), "");
  EXPECT_NE(error("case_degc", "warm"), "");
  EXPECT_NE(error("time_s", "1e11"), "");
  EXPECT_NE(convert(kColumns, row_of("-5", 1)).error, "");
  EXPECT_EQ(convert(kColumns, row_of("5", 6) + ",7").error, "found 18 columns, expected 17");
  EXPECT_THAT(convert("samples", "5").error, HasSubstr("found no column \"time_utc\""));
}

// The tables have the columns of the log: a new column needs a further file in tools/prismrelay/schema.
TEST(RowConverter, HasTheColumnsOfTheTable) {
  std::string sql;
  for (const char* const file : {"1.sql", "2.sql"})
    sql += test::read_file(std::filesystem::path(PRISM_SOURCE_DIR) / "tools/prismrelay/schema" / file);
  for (const compensation::LogColumn& column : compensation::log_columns()) {
    if (column.type == compensation::ColumnType::kTime) continue;
    EXPECT_THAT(sql, HasSubstr(fmt::format(" {} ", column.name)));
  }
}

TEST(RowConverter, QuotesTextAndReplacesNul) {
  EXPECT_EQ(csv_text(std::string("a\"b,\n\0c", 7)),
            "\"a\"\"b,\n\xef\xbf\xbd"
            "c\"");
}

}  // namespace
}  // namespace prism::prismrelay
