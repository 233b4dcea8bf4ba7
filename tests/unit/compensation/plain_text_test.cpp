// SPDX-License-Identifier: MIT
// Foreign text in refusals: one short printable line, whatever it was.
#include "compensation/plain_text.hpp"

#include <gtest/gtest.h>

namespace prism::compensation {
namespace {

TEST(PlainText, LeavesPrintableAsciiAsItIs) { EXPECT_EQ(plain_text(" azAZ09~\"\\"), " azAZ09~\"\\"); }

TEST(PlainText, ShowsEveryOtherByteAsAQuestionMark) {
  EXPECT_EQ(plain_text("a\nb\tc\x7f\xff"), "a?b?c??");
  EXPECT_EQ(plain_text(std::string_view("\0", 1)), "?");
}

TEST(PlainText, MarksItsCut) {
  EXPECT_EQ(plain_text("12345", 5), "12345");
  EXPECT_EQ(plain_text("123456", 5), "12345...");
  EXPECT_EQ(plain_text(std::string(1000, 'x')).size(), 43u);
}

}  // namespace
}  // namespace prism::compensation
