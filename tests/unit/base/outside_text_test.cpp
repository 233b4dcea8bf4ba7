// SPDX-License-Identifier: MIT
// The rules for names and texts, and the escaping of hostile text for each output.
#include "base/outside_text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "base/escape.hpp"
#include "base/plain_text.hpp"
#include "tests/support/blocks.hpp"

namespace prism {
namespace {

TEST(OutsideText, AcceptsOneShortWordAsAxisName) {
  for (const char* name : {"x", "Z", "axis_1", "0123456789abcdef"}) EXPECT_TRUE(follows(TextRule::kAxisName, name));
  for (const char* name : {"", "0123456789abcdefg", "a b", "a.b", "a-b", "a\n", "\xc3\xa9", "x'", "../x"})
    EXPECT_FALSE(follows(TextRule::kAxisName, name)) << name;
}

TEST(OutsideText, AcceptsWordsJoinedByDotsAsSensorAndMessageNames) {
  const std::string longest(32, 'a');
  for (const std::string& name : {std::string("case"), std::string("logger.t1"), longest, longest + "." + longest})
    EXPECT_TRUE(follows(TextRule::kSensorName, name)) << name;
  for (const std::string& name :
       {std::string(), std::string(33, 'a'), std::string("."), std::string("a..b"), std::string("a."),
        std::string(".a"), std::string("a\0", 2), std::string("9A"), std::string("_a"), longest + "." + longest + ".a"})
    EXPECT_FALSE(follows(TextRule::kSensorName, name)) << name;
  EXPECT_TRUE(follows(TextRule::kMessageName, "9A"));
}

TEST(OutsideText, AcceptsPrintableNamesButNoPaths) {
  for (const char* name : {"gyro1", "Gyro 7, north", "\xc3\xbc-1", "a=b", "\xe4\xba\x8c\xe5\x8f\xb7"})
    EXPECT_TRUE(follows(TextRule::kName, name)) << name;
  for (const char* name : {"",
                           ".",
                           "..",
                           ".hidden",
                           "a/b",
                           " a",
                           "a ",
                           "a\nb",
                           "a\tb",
                           "a\x7f",
                           "\x1b[31m",
                           "\xff",
                           "\xc0\xaf",
                           "\xed\xa0\x80",
                           "\xe2\x80\xae",
                           "\xe2\x80\xa8",
                           "\xef\xbb\xbfgyro",
                           "\xc2\x85",
                           "\xef\xbf\xbf",
                           "\xf4\x90\x80\x80"})
    EXPECT_FALSE(follows(TextRule::kName, name)) << name;
  EXPECT_TRUE(follows(TextRule::kName, std::string(90, 'a')));
  EXPECT_FALSE(follows(TextRule::kName, std::string(91, 'a')));
  EXPECT_TRUE(follows(TextRule::kText, ""));
  EXPECT_TRUE(follows(TextRule::kText, std::string(128, 'a')));
  EXPECT_FALSE(follows(TextRule::kText, std::string(129, 'a')));
  EXPECT_FALSE(follows(TextRule::kLongText, std::string(1 << 20, 'a')));
}

TEST(OutsideText, ReportsErrorsInOneSafeLine) {
  EXPECT_EQ(check_text(TextRule::kAxisName, "x'\x1b]0;\a\n<img>", "a.csv:3").error().text(),
            "a.csv:3: found \"x'\\x1b]0;\\x07\\x0a<img>\", expected 1 to 16 letters, digits or _");
  EXPECT_LT(check_text(TextRule::kText, std::string(1 << 20, '\n'), "a").error().text().size(), 500u);
}

TEST(Escape, PrintableKeepsTextAndShowsTheRest) {
  EXPECT_EQ(printable("\xc2\xb0"
                      "C \xe4\xba\x8c"),
            "\xc2\xb0"
            "C \xe4\xba\x8c");
  EXPECT_EQ(printable(std::string("a\0\n\x1b[2J\xff\xe2\x80\xae\xc2\x9b", 13)),
            "a\\x00\\x0a\\x1b[2J\\xff\\u{202e}\\u{009b}");
  EXPECT_EQ(shortened("\xe4\xba\x8c\xe4\xba\x8c", 4), "\xe4\xba\x8c...");
}

TEST(Escape, EscapesMarkupForHtml) {
  EXPECT_EQ(html_text("<img src=x onerror='a()'>&\""), "&lt;img src=x onerror=&#39;a()&#39;&gt;&amp;&quot;");
  EXPECT_EQ(html_text("a\x1b\xff\n"), "a\xef\xbf\xbd\xef\xbf\xbd\n");
}

TEST(Escape, PreventsFormulasInCells) {
  for (const test::Block& row : test::blocks("base/csv_cells.txt", 2))
    EXPECT_EQ(csv_cell(row.text(0)), row.text(1)) << row.where;
}

TEST(Escape, AWordForAShellIsInQuotesIfItNeedsThem) {
  const std::vector<std::pair<std::string, std::string>> words = {{"/lab/gyro-1.csv", "/lab/gyro-1.csv"},
                                                                  {"rate=Gx:deg/s", "rate=Gx:deg/s"},
                                                                  {"", "''"},
                                                                  {"a b", "'a b'"},
                                                                  {"$(reboot)", "'$(reboot)'"},
                                                                  {"it's", "'it'\\''s'"}};
  for (const auto& [text, word] : words) EXPECT_EQ(shell_word(text), word);
}

TEST(Escape, JsonNeverThrows) {
  EXPECT_EQ(json_text(nlohmann::json{{"a\xff", "b\xc3"}}), "{\"a\xef\xbf\xbd\":\"b\xef\xbf\xbd\"}");
}

TEST(PlainText, LeavesPrintableAsciiAsItIs) { EXPECT_EQ(plain_text(" azAZ09~\"\\"), " azAZ09~\"\\"); }

TEST(PlainText, ShowsEveryOtherByteAsAQuestionMark) {
  EXPECT_EQ(plain_text("a\nb\tc\x7f\xff"), "a?b?c??");
  EXPECT_EQ(plain_text(std::string_view("\0", 1)), "?");
}

TEST(PlainText, MarksTruncation) {
  EXPECT_EQ(plain_text("12345", 5), "12345");
  EXPECT_EQ(plain_text("123456", 5), "12345...");
  EXPECT_EQ(plain_text(std::string(1000, 'x')).size(), 43u);
}

TEST(Counted, AddsThePluralS) {
  EXPECT_EQ(counted(0, "row"), "0 rows");
  EXPECT_EQ(counted(1, "row"), "1 row");
  EXPECT_EQ(counted(2, "row"), "2 rows");
}

const std::vector<std::string> kNames = {"baud", "data_bits", "parity", "stop_bits", "retry_min_s", "retry_max_s"};

TEST(NearestName, FindsTheIntendedName) {
  EXPECT_EQ(nearest_name("buad", kNames), "baud") << "two letters swapped";
  EXPECT_EQ(nearest_name("bauds", kNames), "baud") << "one too many";
  EXPECT_EQ(nearest_name("pariy", kNames), "parity") << "one left out";
  EXPECT_EQ(nearest_name("stop-bits", kNames), "stop_bits") << "one changed";
  EXPECT_EQ(nearest_name("retry_max", kNames), "retry_max_s") << "its beginning";
  EXPECT_EQ(nearest_name("baudrate", kNames), "baud") << "more behind it";
}

TEST(NearestName, IsEmptyWithoutASimilarName) {
  EXPECT_EQ(nearest_name("colour", kNames), "");
  EXPECT_EQ(nearest_name("b", kNames), "") << "one letter tells nothing";
  EXPECT_EQ(nearest_name("", kNames), "");
  EXPECT_EQ(nearest_name("baud", {}), "");
  EXPECT_EQ(nearest_name(std::string(100'000, 'b'), kNames), "");
}

}  // namespace
}  // namespace prism
