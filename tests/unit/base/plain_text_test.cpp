// SPDX-License-Identifier: MIT
// External text in messages: always one short printable line.
#include "base/plain_text.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace prism {
namespace {

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
