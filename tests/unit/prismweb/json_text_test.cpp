// SPDX-License-Identifier: MIT
#include "tools/prismweb/json_text.hpp"

#include <gtest/gtest.h>

namespace prism::prismweb {
namespace {

// Copying and writing a value are recursive: each level needs stack.
TEST(Messages, AreLimitedTo32Levels) {
  const auto nested = [](std::size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); };
  EXPECT_TRUE(parse_message(nested(32)).is_array());
  EXPECT_TRUE(parse_message(nested(33)).is_null());
  EXPECT_TRUE(parse_message(nested(30000)).is_null());
  EXPECT_TRUE(parse_message("[").is_null());
  EXPECT_EQ(parse_message(R"({"token":"a"})").dump(), R"({"token":"a"})");
}

TEST(JsonTexts, AreValidUtf8) { EXPECT_EQ(json_text({{"a", "\xff"}}), "{\"a\":\"\xef\xbf\xbd\"}"); }

}  // namespace
}  // namespace prism::prismweb
