// SPDX-License-Identifier: MIT
// External JSON: any type is read without an exception, and any text is printed as the same JSON.
#include "base/json_member.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "base/escape.hpp"
#include "base/outside_text.hpp"
#include "tests/support/hostile_texts.hpp"

namespace prism {
namespace {

using nlohmann::json;

TEST(JsonMember, TreatsAnotherTypeAsMissing) {
  const json object = {{"a", 5}, {"b", "text"}, {"c", true}, {"d", -1}, {"e", 7U}};
  for (const json& value : {object, json(), json(3), json::array({1}), json("a")}) {
    for (const char* key : {"a", "b", "c", "d", "x"}) {
      EXPECT_EQ(text_member(value, key, "no"), value == object && *key == 'b' ? "text" : "no");
      EXPECT_EQ(flag_member(value, key), value == object && *key == 'c');
      EXPECT_EQ(count_member(value, key), 0u);
    }
  }
  EXPECT_EQ(count_member(object, "e"), 7u);
  EXPECT_EQ(number_member(object, "d", 3), -1);
  EXPECT_EQ(number_member(object, "b", 3), 3);
}

TEST(JsonMember, RejectsDeepNesting) {
  const auto nested = [](std::size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); };
  EXPECT_TRUE(parse_json_line(nested(64)));
  EXPECT_FALSE(parse_json_line(nested(65)));
  EXPECT_FALSE(parse_json_line(std::string(4 << 20, '[')));
  EXPECT_TRUE(parse_json_line("{\"" + std::string(100, '[') + "\\\"" + std::string(100, '{') + "\": 1}"));
  EXPECT_FALSE(parse_json_line("{\"a\": 1e999}"));
  EXPECT_FALSE(parse_json_line("\"\xff\""));
}

TEST(PrintableJson, KeepsTheValueWithoutControlCharacters) {
  for (const std::string& text : test::hostile_texts()) {
    const json value = {{"text", valid_utf8(text)}, {valid_utf8(text), {text.size(), "\U000e0001"}}};
    for (const int indent : {-1, 2}) {
      std::string shown = printable_json(json_text(value, indent));
      EXPECT_EQ(json::parse(shown, nullptr, false), value);
      std::erase(shown, '\n');
      EXPECT_TRUE(is_printable(shown)) << shown.substr(0, 200);
    }
  }
  EXPECT_EQ(printable_lines("a\n\033[1m\nb"), "a\n\\x1b[1m\nb");
  EXPECT_EQ(printable_lines(""), "");
}

}  // namespace
}  // namespace prism
