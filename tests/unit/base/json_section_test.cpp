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
#include "base/outside_text.hpp"
#include "base/removed_keys.hpp"
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

TEST(ParseJson, AcceptsAnObjectWithComments) {
  EXPECT_EQ(parse_refusal("{}"), "");
  EXPECT_EQ(parse_refusal("// a note\n{ /* nothing */ }\n"), "");
}

TEST(ParseJson, ReportsFileLineAndColumnOfInvalidJson) {
  EXPECT_EQ(parse_refusal("{\n  \"a\": 1,\n  b\n}"),
            "gyro.json:3:3: not valid JSON: syntax error while parsing object key - invalid literal; last read: "
            "'1,<U+000A>  b'; expected string literal");
  EXPECT_EQ(parse_refusal(""), "gyro.json: is empty, expected a JSON object");
  EXPECT_EQ(parse_refusal("{\"a\": nan}").substr(0, 30), "gyro.json:1:8: not valid JSON:");
  EXPECT_EQ(parse_refusal("{\"a\": Infinity}").substr(0, 29), "gyro.json:1:7: not valid JSON");
  EXPECT_EQ(parse_refusal("{} {}").substr(0, 29), "gyro.json:1:4: not valid JSON");
}

TEST(ParseJson, RejectsANonFiniteNumber) {
  EXPECT_EQ(parse_refusal("{\"a\": 1e999}"), "gyro.json: not valid JSON: number overflow parsing '1e999'");
}

TEST(ParseJson, RejectsOtherThanAnObject) {
  EXPECT_EQ(parse_refusal("[1, 2]"), "gyro.json: found [1,2], expected a JSON object");
  EXPECT_EQ(parse_refusal("null"), "gyro.json: found null, expected a JSON object");
}

TEST(ParseJson, RejectsADuplicateKeyInOneObject) {
  EXPECT_EQ(parse_refusal(R"({"a": 1, "b": {"c": 2, "c": 3}})"), "gyro.json: the key \"c\" is given twice");
  EXPECT_EQ(parse_refusal(R"({"": 1, "": 2})"), "gyro.json: the key \"\" is given twice");
  const auto nested = parse_json_object(R"({"a": {"x": 1}, "b": [{"x": 1}, {"x": 2}], "x": 3})", "gyro.json");
  EXPECT_TRUE(nested);
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
  const std::string rows[] = {std::string("{\"a\": \"\xff\xfe\"}"),
                              std::string("{\"a\": \"") + std::string(100'000, 'x'),
                              "{\"k\n\": 1}",
                              "{\"\xc3\xa4\": 1, \"\xc3\xa4\": 2}",
                              "{\"a\\nb\": 1, \"a\\nb\": 2}",
                              std::string("{\0}", 3),
                              "{\"a\\nb/c\": 1}",
                              "{\"" + std::string(100'000, 'k') + "\": 1}"};
  for (const std::string& row : rows) {
    const std::string line = parse_refusal(row);
    EXPECT_NE(line, "") << row.substr(0, 80);
    EXPECT_LT(line.size(), 240u) << row.substr(0, 80);
    for (const char c : line) EXPECT_TRUE(c >= 0x20 && c <= 0x7e) << line;
  }
}

TEST(Section, ReadsAllTypes) {
  const char* const kNames[] = {"red", "green"};
  const std::string text = R"({"n": 1.5, "i": -3, "b": true, "t": "x", "ns": [1, 2.5], "ts": ["p", "q"], "c": "green",
                               "o": {"k": 1}, "os": [{"k": 2}, {"k": 3}], "any": [null]})";
  EXPECT_EQ(refusal(text,
                    [&](Section& s) {
                      EXPECT_EQ(s.number("n", {1.5, 1.5}), 1.5);
                      EXPECT_EQ(s.integer("i", {-3, -3}), -3);
                      EXPECT_TRUE(s.boolean("b"));
                      EXPECT_EQ(s.text("t"), "x");
                      EXPECT_EQ(s.numbers("ns", {1, 2.5}), (std::vector<double>{1, 2.5}));
                      EXPECT_EQ(s.texts("ts"), (std::vector<std::string>{"p", "q"}));
                      EXPECT_EQ(s.choice("c", kNames), 1u);
                      EXPECT_EQ(s.object("o").integer("k", {0, 9}), 1);
                      auto objects = s.objects("os");
                      ASSERT_EQ(objects.size(), 2u);
                      EXPECT_EQ(objects[0].integer("k", {0, 9}), 2);
                      EXPECT_EQ(objects[1].integer("k", {0, 9}), 3);
                      EXPECT_EQ(s.any("any"), Json::parse("[null]"));
                      EXPECT_TRUE(s.has("any"));
                      EXPECT_FALSE(s.has("none"));
                    }),
            "");
}

TEST(Section, UsesTheDefaultOfAMissingKey) {
  const char* const kNames[] = {"red", "green"};
  EXPECT_EQ(refusal("{}",
                    [&](Section& s) {
                      EXPECT_EQ(s.number("n", {0, 2}, 1.25), 1.25);
                      EXPECT_EQ(s.integer("i", {0, 2}, 2), 2);
                      EXPECT_TRUE(s.boolean("b", true));
                      EXPECT_EQ(s.text("t", "d"), "d");
                      EXPECT_TRUE(s.numbers("ns", {0, 1}, false).empty());
                      EXPECT_TRUE(s.texts("ts", false).empty());
                      EXPECT_EQ(s.choice("c", kNames, 1), 1u);
                      EXPECT_EQ(s.object("o").text("k", "in"), "in");
                      EXPECT_TRUE(s.objects("os", false).empty());
                      EXPECT_TRUE(s.any("any").is_null());
                    }),
            "");
}

constexpr const char* kColours[] = {"red", "green"};

const std::map<std::string, void (*)(Section&)> kReads = {
    {"nothing", [](Section&) {}},
    {"number n",
     [](Section& s) {
       s.number("n", {0, 1});
     }},
    {"number n or 0.5",
     [](Section& s) {
       s.number("n", {0, 1}, 0.5);
     }},
    {"integer i",
     [](Section& s) {
       s.integer("i", {0, 9});
     }},
    {"integer i of 1",
     [](Section& s) {
       s.integer("i", {1, 1});
     }},
    {"boolean t", [](Section& s) { s.boolean("t"); }},
    {"text t", [](Section& s) { s.text("t"); }},
    {"numbers ns",
     [](Section& s) {
       s.numbers("ns", {0, 1});
     }},
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
    {"one or more os", [](Section& s) { s.one_or_more_objects("os"); }},
    {"bits u", [](Section& s) { s.bits("u"); }},
    {"bit list us", [](Section& s) { s.bit_list("us"); }},
    {"bytes h", [](Section& s) { s.bytes("h"); }},
};

TEST(Section, ReportsPositionFoundAndExpected) {
  for (const test::Block& row : test::blocks("base/section_errors.txt", 3))
    EXPECT_EQ(refusal(row[0], kReads.at(row[1])), "gyro.json" + row[2]) << row.where;
}

// A mistyped key is reported with its line and the intended key.
TEST(Section, ReportsAnUnknownKeyWithItsLineAndASimilarKey) {
  const auto read = [](Section& s) {
    Section line = s.object("line");
    line.integer("baud", {50, 20e6}, 9600);
    line.text("parity", "none");
    for (Section& one : s.objects("list", false)) one.number("value", kAnyNumber);
  };
  EXPECT_EQ(refusal("{\n\"line\": {\"parity\": \"even\",\n  \"baund\": 1}}", read),
            "gyro.json:/line/baund: unknown key in line 3; did you mean \"baud\"?");
  EXPECT_EQ(refusal("{\"line\": {},\n // a comment\n\n \"colour\": 1}", read),
            "gyro.json:/colour: unknown key in line 4; expected one of line, list");
  EXPECT_EQ(refusal("{\"list\": [{\"value\": 1},\n{\"value\": [\n3], \"v\": 1}]}", read),
            "gyro.json:/list/1/value: found [3], expected a number within -1.797693135e+308 to 1.797693135e+308");
  EXPECT_EQ(refusal("{\"list\": [{\"value\": 1},\n{\"value\":\n3,\n \"v\": 1}]}", read),
            "gyro.json:/list/1/v: unknown key in line 4; expected one of value");
}

TEST(Section, ReportsAMissingKeyWithASimilarUnknownOne) {
  EXPECT_EQ(refusal("{\n\"bua\": 1,\n\"buad\": 1}",
                    [](Section& s) {
                      s.integer("baud", {0, 9});
                    }),
            "gyro.json: \"baud\" is missing; found \"buad\" in line 3");
}

TEST(Section, ReadsBitsBytesAndFreeNames) {
  EXPECT_EQ(refusal(R"({"u": "0x1F", "d": "12", "us": [1, "0xFF"], "one": 7, "h": "a5 5A00", "names": {"z": 1, "a": 2},
                        "alone": {"k": 1}, "legal": 1})",
                    [](Section& s) {
                      EXPECT_EQ(s.bits("u"), 0x1Fu);
                      EXPECT_EQ(s.bits("d"), 12u);
                      EXPECT_EQ(s.bits("none", 3), 3u);
                      EXPECT_EQ(s.bit_list("us"), (std::vector<std::uint64_t>{1, 255}));
                      EXPECT_EQ(s.bit_list("one"), std::vector<std::uint64_t>{7});
                      EXPECT_EQ(s.bytes("h"), (std::vector<std::uint8_t>{0xA5, 0x5A, 0}));
                      EXPECT_TRUE(s.bytes("no", false).empty());
                      EXPECT_EQ(s.object("names").names(TextRule::kMessageName), (std::vector<std::string>{"z", "a"}));
                      EXPECT_EQ(s.one_or_more_objects("alone").at(0).integer("k", {1, 1}), 1);
                      EXPECT_TRUE(s.is_object("alone"));
                      EXPECT_TRUE(s.is_array("us"));
                      EXPECT_FALSE(s.is_array("none"));
                      s.allow({"legal", "absent"});
                    }),
            "");
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

TEST(Section, ReportsTheFirstError) {
  EXPECT_EQ(refusal(R"({"a": "x", "b": "y", "unknown": 1})",
                    [](Section& s) {
                      s.number("a", {0, 1});
                      EXPECT_FALSE(s.good());
                      s.number("b", {0, 1});
                    }),
            "gyro.json:/a: found \"x\", expected a number within 0 to 1");
}

TEST(Section, AcceptsAnErrorOfItsUser) {
  EXPECT_EQ(refusal(R"({"a": 1})",
                    [](Section& s) {
                      s.fail("a", s.integer("a", {0, 9}) ? "is odd" : "");
                    }),
            "gyro.json:/a: is odd");
  EXPECT_EQ(refusal(R"({})", [](Section& s) { s.fail("", "is empty"); }), "gyro.json: is empty");
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
  EXPECT_EQ(printable_lines("a\n\033[1m\nb"), "a\n\\x1b[1m\nb");
  EXPECT_EQ(printable_lines(""), "");
}

constexpr KeyFile kFile = KeyFile::kPrismd;

struct Outcome {
  std::vector<std::string> warnings;
  std::string error;
};

// Reads a document of which only "known" and "lines" are keys today.
Outcome read(const std::string& text, KeyFile file, std::span<const RemovedKey> table) {
  const Result<JsonDocument> document = parse_json_object(text, "gyro.json");
  if (!document) return {{}, document.error().text()};
  const Section top(*document);
  Outcome outcome{top.removed(file, table), ""};
  top.any("known");
  top.any("lines");
  if (const auto end = top.finish(); !end) outcome.error = end.error().text();
  return outcome;
}

const std::vector<RemovedKey> kTable{{kFile, "radio", false, "use a cable"},
                                     {kFile, "door", true, "close it by hand"},
                                     {kFile, "lines/*/echo", false, "listen"},
                                     {kFile, "lines/**/deep/*/end", false, "stop"},
                                     {KeyFile::kWeb, "window", true, "open it"}};

TEST(RemovedKeys, OneThatWarnsHasNoEffect) {
  const Outcome outcome = read("{\n \"known\": 1,\n \"radio\": {\"any\": [1, 2]}}", kFile, kTable);
  EXPECT_EQ(outcome.error, "");
  EXPECT_EQ(outcome.warnings, std::vector<std::string>{"gyro.json:/radio: removed in prism 0.4 (line 3); use a cable"});
}

TEST(RemovedKeys, OneThatStopsIsTheErrorAlsoIfItIsFalse) {
  EXPECT_EQ(read("{\"known\": 1, \"door\": false}", kFile, kTable).error,
            "gyro.json:/door: removed in prism 0.4 (line 1); close it by hand");
}

TEST(RemovedKeys, AStepMayBeAnyName) {
  const Outcome outcome = read(R"({"lines": {"a/b": {"echo": 1}, "c": {}, "d": {"echo": 2}}})", kFile, kTable);
  EXPECT_EQ(outcome.error, "");
  EXPECT_EQ(outcome.warnings,
            (std::vector<std::string>{"gyro.json:/lines/a~1b/echo: removed in prism 0.4 (line 1); listen",
                                      "gyro.json:/lines/d/echo: removed in prism 0.4 (line 1); listen"}));
  EXPECT_EQ(read(R"({"lines": [{"echo": 1}]})", kFile, kTable).warnings.size(), 1u);
  EXPECT_EQ(read(R"({"lines": "echo"})", kFile, kTable).warnings.size(), 0u);
}

TEST(RemovedKeys, AStepMayBeAnyDepth) {
  const Outcome outcome =
      read(R"({"lines": {"deep": [{"end": 1}], "a": [{"b": {"deep": {"c": {"end": 2}}}}], "end": 3}})", kFile, kTable);
  EXPECT_EQ(outcome.error, "");
  EXPECT_EQ(outcome.warnings,
            (std::vector<std::string>{"gyro.json:/lines/deep/0/end: removed in prism 0.4 (line 1); stop",
                                      "gyro.json:/lines/a/0/b/deep/c/end: removed in prism 0.4 (line 1); stop"}));
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

TEST(RemovedKeys, OfAnotherFileIsUnknown) {
  EXPECT_EQ(read("{\"window\": 1}", kFile, kTable).error,
            "gyro.json:/window: unknown key in line 1; expected one of known, lines");
  EXPECT_EQ(read("{\"echo\": 1}", kFile, kTable).error,
            "gyro.json:/echo: unknown key in line 1; expected one of known, lines");
}

}  // namespace
}  // namespace prism
