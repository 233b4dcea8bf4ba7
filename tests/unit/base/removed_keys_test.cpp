// SPDX-License-Identifier: MIT
// Keys of earlier versions: one warning, or one line that stops the program.
#include "base/removed_keys.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/json_document.hpp"
#include "base/json_section.hpp"

namespace prism {
namespace {

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
