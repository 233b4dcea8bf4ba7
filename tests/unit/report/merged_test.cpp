// SPDX-License-Identifier: MIT
// Merging the reports of several axes.
#include "tools/prismcal/report/merged.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "tools/prismcal/report/html.hpp"

namespace prism::report {
namespace {

using testing::ElementsAre;
using testing::Pair;

Report of_axis(const std::string& chosen) {
  Report report;
  report.title = "gyro 7";
  report.facts = {{"divisor", "N-1"}, {"chosen model", chosen}};
  report.sections = {{"summary", "Summary", {Table{"ladder", "Ladder", "", {{"a"}}, {{text_cell(chosen)}}}}},
                     {"figures", "Figures", {Figure{"heat", "Heat", "", {}}}}};
  return report;
}

Report both() {
  return merged({{"x", of_axis("one")}, {"Y", of_axis("two")}}, {"all", "All axes", {Paragraph{"first"}}});
}

TEST(MergedReport, HasTheOverviewThenTheSectionsOfEachAxis) {
  std::vector<std::string> headings;
  for (const Section& section : both().sections) headings.push_back(section.heading);
  EXPECT_THAT(headings,
              ElementsAre("All axes", "Axis x: Summary", "Axis x: Figures", "Axis Y: Summary", "Axis Y: Figures"));
}

TEST(MergedReport, ListsCommonFactsOnceAndOthersPerAxis) {
  const Report all = both();
  EXPECT_THAT(all.facts, ElementsAre(Pair("divisor", "N-1")));
  const auto& own = std::get<Table>(all.sections[3].blocks.back());
  ASSERT_EQ(own.rows.size(), 1u);
  EXPECT_EQ(own.rows[0][0].text + " " + own.rows[0][1].text, "chosen model two");
}

TEST(MergedReport, HasUniqueIds) {
  std::set<std::string> ids;
  for (const Section& section : both().sections) {
    EXPECT_TRUE(ids.insert(section.id).second) << section.id;
    for (const Block& block : section.blocks) {
      if (const auto* table = std::get_if<Table>(&block)) {
        EXPECT_TRUE(ids.insert(table->id).second) << table->id;
      }
    }
  }
  EXPECT_TRUE(ids.contains("axis2_ladder"));
  EXPECT_EQ(id_of_axis(2, "summary"), "axis2_summary") << "the overview links to it";
}

}  // namespace
}  // namespace prism::report
