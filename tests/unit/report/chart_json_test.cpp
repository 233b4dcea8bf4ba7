// SPDX-License-Identifier: MIT
#include "tools/prismcal/report/chart_json.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

namespace prism::report {
namespace {

Plot of(Series series, Axis x = {"x"}, Axis y = {"y"}) { return {1, 200, {{"", x, y, {}, {std::move(series)}}}}; }

TEST(ChartJson, IsPossibleIfAChartShowsTheSame) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const SeriesStyle form : {SeriesStyle::kLine, SeriesStyle::kPoints, SeriesStyle::kOpenPoints,
                                 SeriesStyle::kLinePoints, SeriesStyle::kBars})
    EXPECT_TRUE(can_be_charted(of({"", Ink::kRaw, form, {1, 2}, {3, 4}})));
  EXPECT_TRUE(can_be_charted(of({"", Ink::kRaw, SeriesStyle::kBand, {1, 2}, {3, 4}, {4, 5}})));
  EXPECT_TRUE(can_be_charted(of({"", Ink::kRaw, SeriesStyle::kPoints, {2, 1}, {3, 4}}))) << "points have no order";
  EXPECT_TRUE(can_be_charted(of({"", Ink::kRaw, SeriesStyle::kLine, {1, 9, 2}, {3, nan, 4}})))
      << "a point that is not drawn does not decrease x";

  EXPECT_FALSE(can_be_charted(of({"", Ink::kRaw, SeriesStyle::kLine, {2, 1}, {3, 4}}))) << "a loop";
  EXPECT_FALSE(can_be_charted(of({"", Ink::kRaw, SeriesStyle::kHeat, {1, 2}, {3, 4}, {5, 6}})));
  EXPECT_FALSE(can_be_charted(of({"", Ink::kRaw, SeriesStyle::kMark, {1}, {3}})));
  EXPECT_FALSE(can_be_charted(of({"", Ink::kRaw, SeriesStyle::kLine, {0, 1}, {3, 4}}, {"x", true})));
  EXPECT_FALSE(can_be_charted(of({"", Ink::kRaw, SeriesStyle::kLine, {1, 2}, {-3, 4}}, {"x"}, {"y", true})));
  EXPECT_FALSE(can_be_charted(of({"", Ink::kRaw, SeriesStyle::kBars, {1, 2}, {3, 4}}, {"x", true})));
  EXPECT_FALSE(can_be_charted(of({"", Ink::kRaw, SeriesStyle::kLine, {1, 2}, {nan, nan}}))) << "nothing to show";
  EXPECT_FALSE(can_be_charted(Plot{}));
}

TEST(ChartJson, HasSevenDigitsAndNullForNan) {
  Series line{"after", Ink::kAccent1, SeriesStyle::kLine, {1, 2, 3}, {0.123456789, std::nan(""), HUGE_VAL}};
  line.right_axis = true;
  Plot plot = of(line, {"t, s", true, 0.5}, {"deg/h"});
  plot.panels[0].right = {"K", false, {}, 9};
  const auto panel = nlohmann::json::parse(chart_json(plot))["panels"][0];
  EXPECT_EQ(panel["x"].dump(), R"({"label":"t, s","log":true,"min":0.5})");
  EXPECT_EQ(panel["right"].dump(), R"({"label":"K","max":9.0})");
  const auto& series = panel["series"][0];
  EXPECT_EQ(series["y"].dump(), "[0.1234568,null,null]");
  EXPECT_EQ(series["dash"].dump(), "[9,4]");
  EXPECT_EQ(series["colour"], "#1f7a5c");
  EXPECT_EQ(series["right"], true);
  EXPECT_EQ(chart_json(plot), chart_json(plot));
}

TEST(ChartJson, EscapesHostileNames) {
  const std::string name = "</script><script>alert(1)</script>\xff<!--";
  const std::string json = chart_json(of({name, Ink::kRaw, SeriesStyle::kLine, {1}, {2}}));
  EXPECT_EQ(json.find('<'), std::string::npos);
  const std::string read = nlohmann::json::parse(json)["panels"][0]["series"][0]["name"];
  EXPECT_EQ(read.substr(0, 34), name.substr(0, 34));
}

}  // namespace
}  // namespace prism::report
