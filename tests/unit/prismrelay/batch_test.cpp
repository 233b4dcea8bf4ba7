// SPDX-License-Identifier: MIT
#include "tools/prismrelay/batch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace prism::prismrelay {
namespace {

using nlohmann::json;
using testing::HasSubstr;

const std::string kLog(32, 'a');

json page_of(std::uint64_t missing = 0) {
  const json page = {{"log", kLog},
                     {"segments",
                      {{{"segment", 2},
                        {"file", "gyro1-1.csv"},
                        {"metadata", {{"model", "m1"}, {"note", std::string("a\0\"b", 4)}}},
                        {"columns", "time_s,samples"},
                        {"first", 5},
                        {"rows", {"10,7", "torn", "86411,8"}}}}},
                     {"after", kLog + "-2-7-9"},
                     {"more", true},
                     {"missing", missing}};
  return json::parse(page.dump());  // numbers as they come: without a sign
}

TEST(Batch, APageBecomesRowsTheirSegmentAndTheirPlace) {
  Batch batch;
  const auto facts = batch.add_page({"lab/g", "z"}, "earliest", page_of());
  ASSERT_TRUE(facts) << facts.error().text();
  EXPECT_EQ(facts->cursor, kLog + "-2-7-9");
  EXPECT_EQ(facts->rows, 2u);
  EXPECT_EQ(facts->refused, 1u);
  EXPECT_TRUE(facts->more);
  EXPECT_EQ(facts->arrival_s, 86411);
  EXPECT_EQ(batch.days(), (std::set<std::int64_t>{0, 1}));
  EXPECT_THAT(batch.text(Batch::kRows), HasSubstr("\"lab/g\",\"z\"," + kLog + ",2,5,10,10,"));
  EXPECT_THAT(batch.text(Batch::kRows), HasSubstr("," + kLog + ",2,7,86411,86411,"));
  EXPECT_EQ(batch.text(Batch::kRefused), "\"lab/g\",\"z\"," + kLog + ",2,6,\"found 1 fields, expected 2\",\"torn\"\n");
  EXPECT_EQ(batch.text(Batch::kSegments),
            "\"lab/g\",\"z\"," + kLog +
                ",2,\"gyro1-1.csv\",\"m1\",\"{\"\"model\"\":\"\"m1\"\",\"\"note\"\":\"\"a?\\\"\"b\"\"}\"\n");
  EXPECT_EQ(batch.text(Batch::kPlaces), "\"lab/g\",\"z\",\"" + kLog + "-2-7-9\"," + kLog + ",2,7,86411.000000,2\n");
  EXPECT_EQ(batch.text(Batch::kGaps), "");
  EXPECT_EQ(batch.places().at({"lab/g", "z"}), kLog + "-2-7-9");
}

TEST(Batch, RowsThatAreMissingAreKeptAsAGap) {
  Batch batch;
  ASSERT_TRUE(batch.add_page({"lab/g", "z"}, "c", page_of(41)));
  EXPECT_EQ(batch.text(Batch::kGaps), "\"lab/g\",\"z\",deleted,\"c\",41\n");
  batch.add_change_of_log({"lab/h", "x"}, "d");
  EXPECT_THAT(batch.text(Batch::kGaps), HasSubstr("\"lab/h\",\"x\",log_changed,\"d\",0\n"));
}

TEST(Batch, WhatIsNoAnswerOfRowsLeavesNothing) {
  const auto without = [](const char* key) {
    json page = page_of();
    page.erase(key);
    return page;
  };
  std::vector<json> wrong = {
      json(), json::array(), "text", without("log"), without("after"), without("segments"), without("missing")};
  wrong.push_back(page_of());
  wrong.back()["log"] = "'; DROP TABLE prism.rows";
  wrong.push_back(page_of());
  wrong.back()["segments"][0]["segment"] = -1;
  wrong.push_back(page_of());
  wrong.back()["segments"][0]["rows"][1] = 7;
  wrong.push_back(page_of());
  wrong.back()["segments"][0]["first"] = 1ULL << 40;
  for (const json& page : wrong) {
    Batch batch;
    const auto facts = batch.add_page({"lab/g", "z"}, "c", page);
    EXPECT_FALSE(facts) << page;
    EXPECT_TRUE(batch.empty()) << page;
  }
}

TEST(Batch, EventsAreCutAtTheBeginningOfACharacter) {
  Batch batch;
  batch.add_event("lab/g",
                  {{"time_s", 1.5}, {"severity", "info"}, {"kind", "note"}, {"text", std::string(999, 'a') + "µ"}});
  EXPECT_EQ(batch.text(Batch::kEvents), "\"lab/g\",1.500000,\"info\",\"note\",\"" + std::string(999, 'a') + "\"\n");
  batch.add_event("lab/g", {{"time_s", "now"}});
  batch.add_event("lab/g", nullptr);
  EXPECT_EQ(std::count(batch.text(Batch::kEvents).begin(), batch.text(Batch::kEvents).end(), '\n'), 1);
}

}  // namespace
}  // namespace prism::prismrelay
