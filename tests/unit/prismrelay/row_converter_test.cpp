// SPDX-License-Identifier: MIT
// Lines of a log are converted to lines of COPY; the expected lines are written by hand.
#include "tools/prismrelay/row_converter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tools/prismrelay/sql_text.hpp"

namespace prism::prismrelay {
namespace {

using testing::HasSubstr;

constexpr const char* kColumns =
    "time_utc,time_s,samples,missing,rate_deg_per_h,temperature_degc,uhfo_v,status,mean_rate_deg_per_h,mean_"
    "temperature_degc,"
    "slope_degc_per_s,mean_uhfo_v,bias_deg_per_h,sd_deg_per_h,corrected_deg_per_h,corrected_mean_deg_per_h,quality,"
    "sd_mean_deg_per_h,arrival_s,sent_deg_per_h,case_degc,chamber.air_degc,partial";
constexpr const char* kRow =
    "2026-11-23T09:11:01Z,1795425061,199,1,8.465401,25.01310,5.251000,0,8.465252,25.01250,0.00001000,5.250500,-0."
    "000125,"
    "0.008400,8.465526,8.465377,good,,1795425061.004,,24.5,,0";

struct Converted {
  std::string error, csv;
  std::int64_t day = 0;
  double arrival_s = 0;
};

Converted convert(const std::string& columns, const std::string& line) {
  Converted row;
  row.error = RowConverter(columns).append(row.csv, {"g,z,l,", 3, 7}, line, row.day, row.arrival_s);
  return row;
}

TEST(RowConverter, IdentifiesColumnsByName) {
  const Converted row = convert(kColumns, kRow);
  EXPECT_EQ(row.error, "");
  EXPECT_EQ(
      row.csv,
      "g,z,l,3,7,1795425061.004,1795425061,\"{\"\"case_degc\"\":24.5}\",199,1,8.465401,25.01310,5.251000,0,8.465252,"
      "25.01250,0.00001000,5.250500,-0.000125,0.008400,8.465526,8.465377,good,,,0\n");
  EXPECT_EQ(row.day, 20780);  // 2026-11-23
  EXPECT_DOUBLE_EQ(row.arrival_s, 1795425061.004);
}

TEST(RowConverter, UsesTheTimeOfALogWithoutArrivals) {
  const Converted row = convert("time_utc,time_s,samples,quality", "x,86400,5,warming");
  EXPECT_EQ(row.csv, "g,z,l,3,7,86400,86400,,5,,,,,,,,,,,,,,warming,,,\n");
  EXPECT_EQ(row.day, 1);
}

TEST(RowConverter, SkipsUnknownColumns) {
  EXPECT_EQ(convert("time_s,unknown,samples", "5,abc,6").csv, convert("time_s,samples", "5,6").csv);
}

TEST(RowConverter, RejectsValuesThatTheServerWouldReject) {
  const auto error = [](const std::string& field, const std::string& value) {
    const Converted row = convert("time_s," + field, "5," + value);
    EXPECT_EQ(row.csv, "") << value;
    return row.error;
  };
  EXPECT_THAT(error("rate_deg_per_h", "nan"), HasSubstr("rate_deg_per_h: found \"nan\""));
  EXPECT_NE(error("rate_deg_per_h", "1e999"), "");
  EXPECT_NE(error("rate_deg_per_h", "0x10"), "");
  EXPECT_NE(error("rate_deg_per_h", " 1"), "");
  EXPECT_NE(error("samples", "2147483648"), "");
  EXPECT_NE(error("status", "9223372036854775808"), "");
  EXPECT_NE(error("partial", "40000"), "");
  EXPECT_NE(error("quality", "a\"b"), "");
  EXPECT_NE(error("quality", std::string("a\0b", 3)), "");
  EXPECT_NE(error("arrival_s", "-1"), "");
  EXPECT_NE(error("arrival_s", "1e12"), "");
  EXPECT_NE(error("case_degc", "warm"), "");
  EXPECT_EQ(convert("time_s,samples", "5").error, "found 1 fields, expected 2");
  EXPECT_EQ(convert("time_s,samples", "5,6,7").error, "found 3 fields, expected 2");
  EXPECT_THAT(convert("time_s", "1e11").error, HasSubstr("time_s"));
  EXPECT_THAT(convert("samples", "5").error, HasSubstr("time_s"));
}

// The server rounds times to microseconds, so the row may be in the next day's partition.
TEST(RowConverter, RoundsTheArrivalBeforeItsDay) {
  EXPECT_EQ(convert("time_s,arrival_s", "5,86399.9999999").day, 1);
  EXPECT_EQ(convert("time_s,arrival_s", "5,86399.999999").day, 0);
  // PostgreSQL subtracts its epoch first: 2505599.9999994994 becomes 1970-01-30 00:00:00.
  EXPECT_EQ(convert("time_s,arrival_s", "5,2505599.9999994994").day, 29);
}

TEST(RowConverter, QuotesTextAndReplacesNul) {
  std::string csv;
  append_quoted(csv, std::string("a\"b,\n\0c", 7));
  EXPECT_EQ(csv,
            "\"a\"\"b,\n\xef\xbf\xbd"
            "c\"");
}

}  // namespace
}  // namespace prism::prismrelay
