// SPDX-License-Identifier: MIT
#include "daemon/socket/row_text.hpp"

#include <gtest/gtest.h>

#include <string>

namespace prism::socket {
namespace {

void append(RowText& text, std::string_view row, std::size_t most) {
  char* at = text.room(most);
  row.copy(at, row.size());
  text.end_at(at + row.size());
}

TEST(RowText, KeepsEveryRowWhileItGrows) {
  RowText text;
  std::string wanted;
  for (int i = 0; i < 1000; ++i) {
    const std::string row = "row " + std::to_string(i) + "\n";
    append(text, row, row.size() + static_cast<std::size_t>(i) % 7 * 100);
    wanted += row;
    ASSERT_EQ(text.view(), wanted);
  }
}

TEST(RowText, IsEmptyBeforeTheFirstRowAndAfterClear) {
  RowText text;
  EXPECT_TRUE(text.view().empty());
  append(text, "one", 3);
  text.clear();
  EXPECT_TRUE(text.view().empty());
  append(text, "two", 100);
  EXPECT_EQ(text.view(), "two");
}

TEST(RowText, HandsOutTheRoomItHasWithoutMoving) {
  RowText text;
  const char* first = text.room(1000);
  append(text, "a row", 100);
  EXPECT_EQ(text.room(900), first + 5);
}

}  // namespace
}  // namespace prism::socket
