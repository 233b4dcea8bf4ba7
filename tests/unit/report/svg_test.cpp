// SPDX-License-Identifier: MIT
// SVG drawings: comparison with drawings/*.svg (PRISM_REGENERATE=1 writes them), and properties of all plots.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "tests/unit/report/markup.hpp"
#include "tools/prismcal/document.hpp"

namespace prism::report {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr SeriesStyle kForms[] = {SeriesStyle::kLine, SeriesStyle::kPoints, SeriesStyle::kOpenPoints,
                                  SeriesStyle::kLinePoints, SeriesStyle::kBand};

void expect_drawing(const std::string& name, const Plot& plot) {
  const std::string path = PRISM_SOURCE_DIR "/tests/unit/report/drawings/" + name + ".svg", svg = draw_svg(plot) + "\n";
  if (std::getenv("PRISM_REGENERATE") != nullptr) {
    ASSERT_TRUE(write_text_file(path, svg));
  }
  const auto expected = read_text_file(path);
  ASSERT_TRUE(expected) << expected.error().text();
  EXPECT_EQ(svg, *expected);
}

Plot one_panel(SeriesStyle form) {
  Series series{"it's a_b", Ink::kModel, form, {1, 1, 100, 100}, {1, 2, 1, 2}, {2, 3, 4, 5}};
  return {1, 200, {{"(a) one", {"x, s", true}, {"y, deg/h"}, {series}}}};
}

TEST(SvgChart, DrawsALineWithAGap) {
  Plot plot{1, 180, {{"(a) bias", {"time, h"}, {"bias, deg/h"}}}};
  plot.panels[0].series = {{"before", Ink::kRaw, SeriesStyle::kLine, {0, 1, 2, 3, 4}, {-0.5, 0.25, kNan, 0.5, 1}},
                           {"temperature", Ink::kModel, SeriesStyle::kLine, {0, 4}, {-0.4, 0.85}}};
  expect_drawing("line", plot);
}

TEST(SvgChart, DrawsABandAndPointsOnLogarithmicAxes) {
  Plot plot{2, 240, {{"", {"averaging time, s", true}, {"Allan deviation, deg/h", true}}}};
  plot.panels[0].series = {{"", Ink::kCorrected, SeriesStyle::kBand, {1, 10, 1000}, {0.9, 0.3, 0.02}, {1.1, 0.4, 0.06}},
                           {"after", Ink::kCorrected, SeriesStyle::kLinePoints, {1, 10, 1000}, {1, 0.35, 0.04}}};
  plot.panels.push_back({"(b) empty", {"x"}, {"y"}});
  plot.panels.push_back({"(c)", {"x", true}, {"y", true}, {{"", Ink::kModel, SeriesStyle::kPoints, {3, 3}, {2, 3}}}});
  expect_drawing("allan", plot);
}

TEST(SvgChart, DrawsPoints) {
  Plot plot{2, 200, {{"(a)", {"residual"}, {"blocks"}}, {"(b)", {"T, °C"}, {"bias"}}}};
  plot.panels[0].series = {{"residual", Ink::kCorrected, SeriesStyle::kLinePoints, {-1, 0, 1, 2}, {3, 7, -2, 1}},
                           {"limit", Ink::kGuide, SeriesStyle::kLinePoints, {-1.5, 2.5}, {5, 5}}};
  plot.panels[1].series = {{"soak", Ink::kRaw, SeriesStyle::kPoints, {1e5, 2e5, 3e5}, {1, 1, 2}},
                           {"heating", Ink::kModel, SeriesStyle::kPoints, {1e5, 2e5, 3e5}, {2, 2, 1}},
                           {"cooling", Ink::kCorrected, SeriesStyle::kOpenPoints, {1e5, 2e5, 3e5}, {1.5, 1.5, 1.5}}};
  expect_drawing("points", plot);
}

// Both axes of a panel have the range; the steps, the digits of the labels, and which of them fit.
TEST(SvgChart, DrawsTheTicksOfEachRange) {
  struct Case {
    double low, high;
    bool logarithmic = false;
  };
  Plot plot{4, 130, {}};
  for (const auto& [low, high, logarithmic] : std::vector<Case>{{0, 1},
                                                                {0, 1.01},
                                                                {0, 2.1},
                                                                {-3, 5.1},
                                                                {-0.05, 0.021},
                                                                {7, 7},
                                                                {0, 0},
                                                                {-4e-3, -4e-3},
                                                                {1e6, 1e6 + 1},
                                                                {123456.7, 123456.9},
                                                                {-1e7, 2e7},
                                                                {0, 1e-9},
                                                                {-1e-200, 1e-200},
                                                                {1e9, 1.5e9},
                                                                {-60, 80},
                                                                {1, 10, true},
                                                                {1, 4.9, true},
                                                                {1, 5.1, true},
                                                                {2, 30, true},
                                                                {1, 99, true},
                                                                {1, 100, true},
                                                                {0.3, 400, true},
                                                                {1e-3, 1e5, true},
                                                                {1e-9, 1e12, true},
                                                                {5, 5, true},
                                                                {1000, 1001, true},
                                                                {0.011, 0.019, true},
                                                                {1, 101, true}}) {
    Series series{"s", Ink::kModel, SeriesStyle::kLine, {low, high}, {low, high}};
    plot.panels.push_back({"", {"x", logarithmic}, {"y", logarithmic}, {series}});
  }
  expect_drawing("ticks", plot);
}

TEST(SvgChart, IsWellFormedAndWithoutNan) {
  for (const SeriesStyle form : kForms) {
    for (const double bad :
         {kNan, HUGE_VAL, -HUGE_VAL, 1e308, -1e308, 0.0, std::numeric_limits<double>::denorm_min()}) {
      for (std::size_t i = 0; i < 4; ++i) {
        Plot plot = one_panel(form);
        Series& series = plot.panels[0].series[0];
        series.x[i] = series.y[3 - i] = bad;
        series.high[i] = bad;
        plot.panels[0].y.logarithmic = i % 2 == 0;
        const std::string svg = draw_svg(plot);
        EXPECT_TRUE(test::elements_of(svg)) << svg;
        EXPECT_THAT(svg, Not(ContainsRegex("[^a-z]nan|[^a-z]inf|e\\+[0-9]+[ \"]"))) << bad;
      }
    }
  }
}

TEST(SvgChart, DrawsPanelsWithNoneOrOnePoint) {
  for (const SeriesStyle form : kForms) {
    Plot plot = one_panel(form);
    Series& series = plot.panels[0].series[0];
    series.x = {5}, series.y = {7}, series.high = {8};
    EXPECT_TRUE(test::elements_of(draw_svg(plot)));
    series.x.clear();
    EXPECT_TRUE(test::elements_of(draw_svg(plot)));
    plot.panels[0].series.clear();
    EXPECT_THAT(draw_svg(plot), HasSubstr(">y, deg/h</text>"));
  }
  EXPECT_TRUE(test::elements_of(draw_svg(Plot{})));
}

TEST(SvgChart, HasFewTicksOnNarrowRanges) {
  for (const double value : {1.0, -1.0, 1e9, 1e-140, 1e140}) {
    for (const double width : {1e-16, 1e-13, 1e-11, 1e-8}) {
      Plot plot = one_panel(SeriesStyle::kLine);
      plot.panels[0].y.logarithmic = value > 0;
      plot.panels[0].series[0].y = {value, value * (1 + width), value, value};
      plot.panels[0].series[0].x = plot.panels[0].series[0].y;
      EXPECT_LT(draw_svg(plot).size(), 10'000u);
    }
  }
}

TEST(SvgChart, HasTheValuesOfFewPoints) {
  EXPECT_THAT(draw_svg(one_panel(SeriesStyle::kLinePoints)), HasSubstr("<title>100, 2</title>"));
  EXPECT_THAT(draw_svg(one_panel(SeriesStyle::kLine)), Not(HasSubstr("<title>")));
  Plot plot = one_panel(SeriesStyle::kPoints);
  plot.panels[0].series[0].x.assign(101, 1);
  plot.panels[0].series[0].y.assign(101, 1);
  EXPECT_THAT(draw_svg(plot), Not(HasSubstr("<title>"))) << "too many to point at";
}

TEST(SvgChart, LeavesOutWhatIsTooLargeOrTooSmallForItsAxis) {
  Plot plot = one_panel(SeriesStyle::kPoints);
  const auto drawn = [&](bool logarithmic, double value) {
    plot.panels[0].y.logarithmic = logarithmic;
    plot.panels[0].series[0].y[2] = value;
    const std::string svg = draw_svg(plot);
    EXPECT_TRUE(test::elements_of(svg)) << value;
    return svg.find(fmt::format("<title>100, {:.4g}</title>", value)) != std::string::npos;
  };
  for (const bool logarithmic : {false, true}) {
    EXPECT_TRUE(drawn(logarithmic, 9.9e149));
    EXPECT_FALSE(drawn(logarithmic, 1e150));
    EXPECT_TRUE(drawn(logarithmic, 1.1e-150));
    EXPECT_EQ(drawn(logarithmic, 1 / 1e150), !logarithmic);
    EXPECT_EQ(drawn(logarithmic, 0), !logarithmic);
    EXPECT_EQ(drawn(logarithmic, -9.9e149), !logarithmic);
    EXPECT_FALSE(drawn(logarithmic, -1e150));
  }
}

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
  report.sections = {{"s", "S", {Figure{"f", "F", "", {1, 260, {Panel{"", {}, {}, {series}}}}}}}};
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
  Table table{"t", "T", "", columns("name: | n | error"), {}};
  for (int i = 0; i < 1000; ++i)
    table.rows.push_back({Cell(std::to_string(i)), fixed_cell(i, 0), fixed_cell(i == 777 ? 9 : i == 888 ? -9 : 0, 0)});
  table.rows[500][1] = Cell(kNothing);
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

TEST(Reduced, ATableOfTheMostRowsIsUnchanged) {
  const auto rows_of = [](std::size_t count) {
    Table table{"t", "T", "Of all.", columns("n | m"), {}};
    for (std::size_t i = 0; i < count; ++i) table.rows.push_back({count_cell(i), count_cell((i * 7919 + 100) % count)});
    const Table few = std::get<Table>(reduced(Block(table)));
    std::string text = few.caption;
    for (std::size_t i = 0; i < few.rows.size(); ++i) {
      if (i < 3 || i + 3 >= few.rows.size()) text += " " + few.rows[i][0].text;
    }
    return text;
  };
  EXPECT_EQ(rows_of(kMostRows), fmt::format("Of all. 0 1 2 {} {} {}", kMostRows - 3, kMostRows - 2, kMostRows - 1));
  const char* const how =
      "those with the smallest and largest values, and others at equal distances; all: --all-blocks.";
  EXPECT_EQ(rows_of(kMostRows + 1), fmt::format("Of all. 397 of 401 rows: {} 0 1 2 398 399 400", how));
  EXPECT_EQ(rows_of(3 * kMostRows), fmt::format("Of all. 397 of 1200 rows: {} 0 3 6 1193 1196 1199", how));
}

}  // namespace
}  // namespace prism::report
