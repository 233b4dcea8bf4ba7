// SPDX-License-Identifier: MIT
// Sections: every key is used once, every error is one line with its position.
#include "base/json_section.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/escape.hpp"
#include "base/json_document.hpp"
#include "base/json_member.hpp"
#include "base/json_table.hpp"
#include "base/outside_text.hpp"
#include "tests/support/blocks.hpp"
#include "tests/support/hostile_texts.hpp"

namespace prism {
namespace {

// Error of a reader that calls `read` on the object; "" without an error.
template <class Read>
std::string refusal(const std::string& text, Read&& read) {
  const Result<JsonDocument> document = parse_json_object(text, "gyro.json");
  if (!document) return document.error().text();
  Section section(*document);
  read(section);
  const Result<void> end = section.finish();
  return end ? "" : end.error().text();
}

std::string parse_refusal(const std::string& text) {
  return refusal(text, [](Section&) {});
}

TEST(ParseJson, RejectsAMillionBracketsWithoutRecursion) {
  for (const std::string open : {"[", "{\"a\":"}) {
    std::string text = "{\"a\": ", close;
    for (int i = 0; i < 1'000'000; ++i) text += open;
    text += "1";
    for (int i = 0; i < 1'000'000; ++i) text += open == "[" ? "]" : "}";
    EXPECT_EQ(parse_refusal(text + "}"), "gyro.json: nested deeper than 32 levels");
  }
  std::string deep;
  for (int i = 0; i < 32; ++i) deep += "{\"a\":";
  deep += "1" + std::string(32, '}');
  EXPECT_TRUE(parse_json_object(deep, "gyro.json"));
  EXPECT_FALSE(parse_json_object("{\"a\":" + deep + "}", "gyro.json"));
}

TEST(ParseJson, ReportsErrorsInOneShortLine) {
  const std::string rows[] = {"{\"a\": \"\xff\xfe\"}", "{\"a\": \"" + std::string(100'000, 'x'),
                              "{\"k\n\": 1}",          "{\"\xc3\xa4\": 1, \"\xc3\xa4\": 2}",
                              std::string("{\0}", 3),  "{\"a\\nb\": 1, \"a\\nb\": 2}",
                              "{\"a\\nb/c\": 1}",      "{\"" + std::string(100'000, 'k') + "\": 1}"};
  for (const std::string& row : rows) {
    const std::string line = parse_refusal(row);
    EXPECT_NE(line, "") << row.substr(0, 80);
    EXPECT_LT(line.size(), 240u) << row.substr(0, 80);
    for (const char c : line) EXPECT_TRUE(c >= 0x20 && c <= 0x7e) << line;
  }
}

constexpr const char* kColours[] = {"red", "green"};
constexpr Range kUnit{0, 1}, kDigit{0, 9}, kOne{1, 1};

/// The numbers "k" of one object, or of an array of them.
std::vector<int> one_or_more(const Section& section, const char* key) {
  using Numbers = JsonTable<std::vector<int>>;
  std::vector<int> numbers;
  Numbers()
      .objects(
          Numbers::Form::kOneOrMore, key, JsonTable<int>().integer("k", kDigit, std::identity(), ""),
          [](const Section&, const std::string&, int number, std::vector<int>& all) { all.push_back(number); }, "")
      .read(section, numbers);
  return numbers;
}

TEST(Section, ReadsAllTypes) {
  const std::string text = R"({"n": 1.5, "i": -3, "b": true, "t": "x", "ns": [1, 2.5], "ts": ["p", "q"], "c": "green",
                               "o": {"k": 1}, "os": [{"k": 2}, {"k": 3}], "any": [null], "u": "0x1F", "d": "12",
                               "us": [1, "0xFF"], "one": 7, "h": "a5 5A00", "names": {"z": 1, "a": 2},
                               "alone": {"k": 1}, "legal": 1})";
  const auto read = [&](Section& s) {
    EXPECT_EQ(s.number("n", {1.5, 1.5}), 1.5);
    EXPECT_EQ(s.integer("i", {-3, -3}), -3);
    EXPECT_TRUE(s.boolean("b"));
    EXPECT_EQ(s.text("t"), "x");
    EXPECT_EQ(s.numbers("ns", {1, 2.5}), (std::vector<double>{1, 2.5}));
    EXPECT_EQ(s.texts("ts"), (std::vector<std::string>{"p", "q"}));
    EXPECT_EQ(s.choice("c", kColours), 1u);
    EXPECT_EQ(s.object("o").integer("k", {0, 9}), 1);
    auto objects = s.objects("os");
    ASSERT_EQ(objects.size(), 2u);
    EXPECT_EQ(objects[0].integer("k", {0, 9}), 2);
    EXPECT_EQ(objects[1].integer("k", {0, 9}), 3);
    EXPECT_EQ(s.any("any"), Json::parse("[null]"));
    EXPECT_TRUE(s.has("any"));
    EXPECT_FALSE(s.has("none"));
    EXPECT_EQ(s.bits("u"), 0x1Fu);
    EXPECT_EQ(s.bits("d"), 12u);
    EXPECT_EQ(s.bit_list("us"), (std::vector<std::uint64_t>{1, 255}));
    EXPECT_EQ(s.bit_list("one"), std::vector<std::uint64_t>{7});
    EXPECT_EQ(s.bytes("h"), (std::vector<std::uint8_t>{0xA5, 0x5A, 0}));
    EXPECT_EQ(s.object("names").names(TextRule::kMessageName), (std::vector<std::string>{"z", "a"}));
    EXPECT_EQ(one_or_more(s, "alone"), std::vector<int>{1});
    EXPECT_EQ(one_or_more(s, "os"), (std::vector<int>{2, 3}));
    EXPECT_EQ(one_or_more(s, "none"), std::vector<int>{});
    EXPECT_TRUE(s.is_object("alone"));
    EXPECT_TRUE(s.is_array("us"));
    EXPECT_FALSE(s.is_array("none"));
    EXPECT_TRUE(s.has("legal"));
  };
  EXPECT_EQ(refusal(text, read), "");
}

TEST(Section, UsesTheDefaultOfAMissingKey) {
  const auto read = [&](Section& s) {
    EXPECT_EQ(s.number("n", {0, 2}, 1.25), 1.25);
    EXPECT_EQ(s.integer("i", {0, 2}, 2), 2);
    EXPECT_TRUE(s.boolean("b", true));
    EXPECT_EQ(s.text("t", "d"), "d");
    EXPECT_TRUE(s.numbers("ns", {0, 1}, false).empty());
    EXPECT_TRUE(s.texts("ts", false).empty());
    EXPECT_EQ(s.choice("c", kColours, 1), 1u);
    EXPECT_EQ(s.object("o").text("k", "in"), "in");
    EXPECT_TRUE(s.objects("os", false).empty());
    EXPECT_TRUE(s.any("any").is_null());
    EXPECT_EQ(s.bits("u", 3), 3u);
    EXPECT_TRUE(s.bytes("h", false).empty());
  };
  EXPECT_EQ(refusal("{}", read), "");
}

const std::map<std::string, void (*)(Section&)> kReads = {
    {"nothing", [](Section&) {}},
    {"number n", [](Section& s) { s.number("n", kUnit); }},
    {"number n or 0.5", [](Section& s) { s.number("n", kUnit, 0.5); }},
    {"integer i", [](Section& s) { s.integer("i", kDigit); }},
    {"integer i of 1", [](Section& s) { s.integer("i", kOne); }},
    {"boolean t", [](Section& s) { s.boolean("t"); }},
    {"text t", [](Section& s) { s.text("t"); }},
    {"numbers ns", [](Section& s) { s.numbers("ns", kUnit); }},
    {"texts ts", [](Section& s) { s.texts("ts"); }},
    {"choice c", [](Section& s) { s.choice("c", kColours); }},
    {"explained choice c",
     [](Section& s) {
       s.explained_choice("c", {{"red", "of fire"}, {"green", "of grass"}, {"white", "of snow"}});
     }},
    {"object o", [](Section& s) { s.object("o"); }},
    {"object o, required", [](Section& s) { s.object("o", true); }},
    {"object o with text t", [](Section& s) { s.object("o").text("t"); }},
    {"objects os", [](Section& s) { s.objects("os"); }},
    {"one or more os", [](Section& s) { one_or_more(s, "os"); }},
    {"bits u", [](Section& s) { s.bits("u"); }},
    {"bit list us", [](Section& s) { s.bit_list("us"); }},
    {"bytes h", [](Section& s) { s.bytes("h"); }},
    {"integer baud", [](Section& s) { s.integer("baud", kDigit); }},
    {"line and list",
     [](Section& s) {
       Section line = s.object("line");
       line.integer("baud", {50, 20e6}, 9600);
       line.text("parity", "none");
       for (Section& one : s.objects("list", false)) one.number("value", kAnyNumber);
     }},
    {"two numbers",  // the first error counts
     [](Section& s) {
       s.number("a", kUnit);
       EXPECT_FALSE(s.good());
       s.number("b", kUnit);
     }},
    {"integer a, odd", [](Section& s) { s.fail("a", s.integer("a", kDigit) ? "is odd" : ""); }},
    {"an error of its user", [](Section& s) { s.fail("", "is empty"); }},
};

// A text in quotes has escapes.
TEST(Section, ReportsPositionFoundAndExpected) {
  for (const test::Block& row : test::blocks("base/section_errors.txt", 3)) {
    const std::string found = refusal(row[0][0] == '"' ? row.text(0) : row[0], kReads.at(row[1]));
    EXPECT_EQ(found, row[2] == "good" ? "" : "gyro.json" + row[2]) << row.where;
  }
}

// After an error the caller continues with the returned value, which is in the range if there is one.
TEST(Section, ReturnsANumberInRangeAfterAnError) {
  EXPECT_NE(refusal(R"({"n": "x", "i": "x"})",
                    [](Section& s) {
                      EXPECT_EQ(s.number("n", {3, 64}), 3);
                      EXPECT_EQ(s.integer("i", {-9, -2}), -2);
                    }),
            "");
}

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
}

const std::vector<RemovedKey> kTable{{KeyFile::kPrismd, "radio", false, "use a cable"},
                                     {KeyFile::kPrismd, "door", true, "close it by hand"},
                                     {KeyFile::kPrismd, "lines/*/echo", false, "listen"},
                                     {KeyFile::kPrismd, "lines/**/deep/*/end", false, "stop"},
                                     {KeyFile::kWeb, "window", true, "open it"}};

// Documents of which only "known" and "lines" are keys today; then the warnings, and the error or "good".
TEST(RemovedKeys, WarnOrAreTheError) {
  for (const test::Block& row : test::blocks("base/removed_keys.txt", -2)) {
    std::vector<std::string> found = {row[0]};
    const std::string error = refusal(row[0][0] == '"' ? row.text(0) : row[0], [&](Section& top) {
      for (const std::string& warning : top.removed(KeyFile::kPrismd, kTable)) found.push_back(warning);
      top.any("known");
      top.any("lines");
    });
    found.push_back(error.empty() ? "good" : error);
    EXPECT_EQ(found, row.lines) << row.where;
  }
}

TEST(RemovedKeys, EachOfTheTableWarnsOrStopsAndNamesTheReplacement) {
  ASSERT_FALSE(removed_keys().empty());
  for (const RemovedKey& key : removed_keys()) {
    Json value = 1;
    for (std::string path(key.path); !path.empty();) {
      const std::size_t slash = path.rfind('/');
      const std::string step = slash == std::string::npos ? path : path.substr(slash + 1);
      Json outer = Json::object();
      outer[step.starts_with('*') ? "any" : step] = std::move(value);
      value = std::move(outer);
      path.resize(slash == std::string::npos ? 0 : slash);
    }
    const Result<JsonDocument> document = parse_json_object(value.dump(), "file");
    const Section top(*document);
    const std::vector<std::string> warnings = top.removed(key.file);
    EXPECT_EQ(top.good(), !key.stops) << key.path;
    EXPECT_EQ(warnings.size(), key.stops ? 0u : 1u) << key.path;
    EXPECT_FALSE(key.instead.empty()) << key.path;
  }
}

}  // namespace
}  // namespace prism
