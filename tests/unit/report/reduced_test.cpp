// SPDX-License-Identifier: MIT
// Long series keep their extremes and means; short ones are unchanged.
#include "tools/prismcal/report/reduced.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "tools/prismcal/report/html.hpp"
#include "tools/prismcal/report/text_output.hpp"

namespace prism::report {
namespace {

/// A year of blocks: a noise, one spike, one hole.
Report long_report(std::size_t points, SeriesStyle form) {
  Series series{"bias", Ink::kRaw, form};
  for (std::size_t i = 0; i < points; ++i) {
    series.x.push_back(static_cast<double>(i) / 36);
    series.y.push_back(std::sin(static_cast<double>(i * i % 1000)));
  }
  series.y[points / 2] = 25;
  for (std::size_t i = points / 4; i < points / 4 + points / 100; ++i) series.y[i] = NAN;
  if (form == SeriesStyle::kPoints) std::rotate(series.x.begin(), series.x.begin() + 100, series.x.end());
  Report report;
  report.sections = {{"s", "S", {Figure{"f", "F", "", {1, 260, {Panel{"", {}, {}, {}, {series}}}}}}}};
  return report;
}

const Panel& panel_of(const Report& report) { return std::get<Figure>(report.sections[0].blocks[0]).plot.panels[0]; }

TEST(Reduced, ALineBecomesItsMeanAndABandWithItsExtremes) {
  const Report report = long_report(315'000, SeriesStyle::kLine);
  const Panel panel = panel_of(reduced(report));
  ASSERT_EQ(panel.series.size(), 2u);
  const Series &band = panel.series[0], &line = panel.series[1];
  EXPECT_EQ(band.form, SeriesStyle::kBand);
  EXPECT_EQ(line.name, "bias");
  ASSERT_EQ(line.x.size(), kIntervals);
  EXPECT_EQ(*std::max_element(band.high.begin(), band.high.end()), 25) << "a spike of one block is visible";
  EXPECT_EQ(std::count_if(line.y.begin(), line.y.end(), [](double y) { return std::isnan(y); }), 4) << "the hole";
  const auto& x = panel_of(report).series[0].x;
  const auto& y = panel_of(report).series[0].y;
  const std::size_t each = x.size() / kIntervals;
  EXPECT_NEAR(line.y[0], std::accumulate(y.begin(), y.begin() + each, 0.0) / static_cast<double>(each), 2e-3);
}

TEST(Reduced, PointsAreThinned) {
  const Panel panel = panel_of(reduced(long_report(315'000, SeriesStyle::kPoints)));
  ASSERT_EQ(panel.series.size(), 1u);
  EXPECT_LE(panel.series[0].x.size(), kMostPoints);
  EXPECT_GT(panel.series[0].x.size(), kMostPoints / 8);
  EXPECT_EQ(*std::max_element(panel.series[0].y.begin(), panel.series[0].y.end()), 25);
}

TEST(Reduced, ShortSeriesAreUnchanged) {
  const Report report = long_report(kLongSeries, SeriesStyle::kLine);
  EXPECT_EQ(json_text(reduced(report)), json_text(report));
}

TEST(Reduced, AYearIsAPageOfSomeKilobytes) {
  const Report year = reduced(long_report(315'000, SeriesStyle::kLine));
  EXPECT_LT(json_text(year).size(), 60'000u);
  EXPECT_NE(json_text(year).find("--all-blocks"), std::string::npos);
  EXPECT_LT(html_page(year).size(), html_page(long_report(100, SeriesStyle::kLine)).size() + 100'000);
}

// Before, the first 400 rows remained: the segment with the largest error was not in the report of a year.
TEST(Reduced, ALongTableKeepsItsExtremes) {
  Report report;
  Table table{"t", "T", "", {{"name", "", false}, {"n"}, {"error"}}, {}};
  for (int i = 0; i < 1000; ++i)
    table.rows.push_back({text_cell(std::to_string(i)), fixed_cell(i, 0),
                          fixed_cell(i == 777   ? 9
                                     : i == 888 ? -9
                                                : 0,
                                     0)});
  table.rows[500][1] = text_cell(kNothing);
  report.sections = {{"s", "S", {table}}};
  const Report once = reduced(report);
  const Table few = std::get<Table>(once.sections[0].blocks[0]);
  EXPECT_LE(few.rows.size(), kMostRows);
  EXPECT_GE(few.rows.size(), kMostRows - 6);
  const auto has = [&](const std::string& name) {
    return std::any_of(few.rows.begin(), few.rows.end(), [&](const auto& row) { return row[0].text == name; });
  };
  EXPECT_TRUE(has("0") && has("777") && has("888") && has("999"));
  EXPECT_TRUE(std::is_sorted(few.rows.begin(), few.rows.end(),
                             [](const auto& a, const auto& b) { return std::stoi(a[0].text) < std::stoi(b[0].text); }));
  EXPECT_NE(few.caption.find(" of 1000 rows: those with the smallest and largest values"), std::string::npos);
  EXPECT_EQ(json_text(reduced(once)), json_text(once));
}

}  // namespace
}  // namespace prism::report
