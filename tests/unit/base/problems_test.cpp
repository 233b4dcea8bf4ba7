// SPDX-License-Identifier: MIT
#include "base/problems.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace prism {
namespace {

using testing::ElementsAre;
using Level = Problem::Level;

struct ProblemsTest : testing::Test {
  std::vector<std::string> told;
  Problems problems{[this](bool begins, const std::string& kind, const std::string& text) {
    told.push_back((begins ? "+" : "-") + kind + ": " + text);
  }};
};

TEST_F(ProblemsTest, AreToldOnceWhenTheyBeginAndOnceWhenTheyEnd) {
  problems.clear("a", "never was");
  problems.set("a", {.kind = "disk", .text = "no answer for 5 s"});
  problems.set("a", {.kind = "disk", .text = "no answer for 6 s"});
  EXPECT_EQ(problems.find("a").text, "no answer for 6 s");
  problems.clear("a", "it answers");
  problems.clear("a", "it answers");
  problems.set("a", {.kind = "disk", .text = "again"});
  problems.forget("a");
  EXPECT_FALSE(problems.has("a"));
  EXPECT_THAT(told, ElementsAre("+disk: no answer for 5 s", "-disk: it answers", "+disk: again"));
}

TEST_F(ProblemsTest, OneThatFlickersIsOneAndIsListedOnlyWhileItExists) {
  for (int i = 0; i < 5; ++i) {
    problems.set("a", {.kind = "k", .text = "bad", .unit = "rows", .count = 2});
    EXPECT_EQ(problems.list().size(), 1u);
    problems.clear("a", "good", 2);
    EXPECT_TRUE(problems.list().empty());
  }
  EXPECT_THAT(problems.find("a").shown(), testing::MatchesRegex("bad \\(10 rows since 20.*Z\\)"));
  problems.clear("a", "good", 2);
  EXPECT_THAT(told, ElementsAre("+k: bad", "-k: good"));
}

TEST_F(ProblemsTest, FailuresAreFirstAndOneKindCanEndTogether) {
  problems.set("a", {.kind = "k", .text = "caution"});
  problems.set("b", {.kind = "q", .level = Level::kFailed, .text = "failure"});
  problems.set("c", {.kind = "k", .text = "other"});
  std::vector<std::string> texts;
  for (const Problem& problem : problems.list()) texts.push_back(problem.text);
  EXPECT_THAT(texts, ElementsAre("failure", "caution", "other"));
  problems.clear_all("k", "over: ");
  EXPECT_EQ(problems.list().size(), 1u);
  EXPECT_THAT(std::vector(told.end() - 2, told.end()), ElementsAre("-k: over: caution", "-k: over: other"));
}

}  // namespace
}  // namespace prism
