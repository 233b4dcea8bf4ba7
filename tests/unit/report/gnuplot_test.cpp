// SPDX-License-Identifier: MIT
// Figures: the program that is written for gnuplot, and what the real gnuplot makes of it.
#include "tools/prismcal/report/gnuplot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

namespace prism::report {
namespace {

using testing::HasSubstr;
using testing::Not;

Plot one_panel(Form form) {
  Series series{"it's a_b", Ink::kModel, form, {1, 10, 100, 1000}, {1, 2, 3, 4}, {2, 3, 4, 5}};
  Panel panel{"(a) one", {"x, s", true}, {"y, deg/h"}, {}, {series}};
  return {1, 200, {panel}};
}

TEST(GnuplotScript, KeepsTextThatGnuplotWouldRead) {
  const std::string script = gnuplot_script(one_panel(Form::kLine), "fig", "/tmp/a_b/o'clock.svg");
  EXPECT_THAT(script, HasSubstr("title 'it''s a\\_b'"));
  EXPECT_THAT(script, HasSubstr("set output '/tmp/a_b/o''clock.svg'"));
  EXPECT_THAT(script, HasSubstr("name 'fig'"));
  EXPECT_THAT(script, HasSubstr("set logscale x\n"));
  EXPECT_THAT(script, HasSubstr("unset logscale y\n"));
}

TEST(GnuplotScript, BreaksACurveAtWhatIsUnknown) {
  Plot plot = one_panel(Form::kLine);
  plot.panels[0].series[0].y[1] = std::nan("");
  EXPECT_THAT(gnuplot_script(plot, "fig", "x.svg"), HasSubstr("1 1 0\n\n100 3 0\n"));
}

TEST(GnuplotScript, DrawsASurfaceAsCellsThatTouch) {
  Plot plot;
  Series heat{"", Ink::kRaw, Form::kHeat, {1, 1, 100, 100}, {0, 1, 0, 1}, {5, 6, 7, 8}};
  plot.panels = {{"surface", {"c", true}, {"s"}, {}, {heat}}};
  const std::string script = gnuplot_script(plot, "fig", "x.svg");
  EXPECT_THAT(script, HasSubstr("1 0 0.1 10 -0.5 0.5 5\n"));
  EXPECT_THAT(script, HasSubstr("100 1 10 1000 0.5 1.5 8\n"));
}

TEST(Gnuplot, DrawsEveryForm) {
  for (const Form form : {Form::kLine, Form::kPoints, Form::kOpenPoints, Form::kLinePoints, Form::kBand, Form::kBars,
                          Form::kHeat, Form::kMark}) {
    Plot plot = one_panel(form);
    plot.panels[0].x.logarithmic = form != Form::kBars;  // bars have no width on a logarithmic axis
    const auto svg = draw_svg(plot, "fig");
    ASSERT_TRUE(svg) << svg.error().text();
    EXPECT_THAT(*svg, testing::StartsWith("<svg"));
    EXPECT_THAT(*svg, testing::EndsWith("</svg>"));
    EXPECT_THAT(*svg, HasSubstr("deg/h"));
    EXPECT_THAT(*svg, Not(HasSubstr("NaN")));
  }
}

TEST(Gnuplot, DrawsAPanelWithoutASinglePoint) {
  Plot plot = one_panel(Form::kLine);
  plot.panels[0].series[0].x.clear();
  plot.panels[0].series[0].y.clear();
  plot.panels.push_back({"(b) no series", {}, {}, {}, {}});
  const auto svg = draw_svg(plot, "fig");
  EXPECT_TRUE(svg) << svg.error().text();
}

TEST(Gnuplot, SaysWhatToInstallWhereItIsMissing) {
  const std::string path = std::getenv("PATH");
  setenv("PATH", "/nowhere", 1);
  const auto svg = draw_svg(one_panel(Form::kLine), "fig");
  setenv("PATH", path.c_str(), 1);
  ASSERT_FALSE(svg);
  EXPECT_EQ(svg.error().text(), "gnuplot: cannot be started; expected Debian's package gnuplot-nox");
}

}  // namespace
}  // namespace prism::report
