// SPDX-License-Identifier: MIT
// Report formats: HTML, CSV and JSON have the same numbers, and never NaN.
#include "tools/prismcal/document.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "tests/unit/report/markup.hpp"

namespace prism::report {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Cell, PrintsDecimalsDigitsAndPercent) {
  EXPECT_EQ(fixed_cell(0.018504, 5).text, "0.01850");
  EXPECT_EQ(fixed_cell(-0.0000001, 3).text, "0.000");
  EXPECT_EQ(fixed_cell(-0.5, 3).text, "-0.500");
  EXPECT_EQ(general_cell(405800, 5).text, "4.058e+05");
  EXPECT_EQ(percent_cell(0.6119).text, "61.19");
  EXPECT_DOUBLE_EQ(*percent_cell(0.6119).value, 61.19);
}

TEST(Cell, ShowsADashForUnknownNumbers) {
  for (const Cell& cell : {fixed_cell(std::nullopt, 2), fixed_cell(std::numeric_limits<double>::quiet_NaN(), 2),
                           general_cell(std::numeric_limits<double>::infinity(), 3), percent_cell(std::nullopt)}) {
    EXPECT_EQ(cell.text, kNothing);
    EXPECT_FALSE(cell.value);
  }
}

TEST(Column, HasItsUnitAndAlignmentInItsText) {
  const auto all = columns("gyro: | before [deg/h] | 95 % of further [%] | :");
  ASSERT_EQ(all.size(), 4u);
  EXPECT_EQ(all[0].name, "gyro");
  EXPECT_FALSE(all[0].number);
  EXPECT_EQ(all[1].name, "before");
  EXPECT_EQ(all[1].unit, "deg/h");
  EXPECT_TRUE(all[1].number);
  EXPECT_EQ(all[2].name, "95 % of further");
  EXPECT_EQ(all[3].name, "");
}

Report sample() {
  Report report;
  report.title = "Gyro <7> & \"friends\"";
  report.tool = "prismcal 0.1.0";
  report.facts = {{"files", "a,b.csv"}};
  Table table{"ls", "LS model", "Divisor N-1.", {{"Input", "", false}, {"After", "deg/h"}}, {}};
  table.rows = {{Cell("T"), fixed_cell(0.011941, 5)}, {Cell("U, \"volts\""), fixed_cell(std::nullopt, 5)}};
  Figure figure{"fig_ls", "Residual", "100 s means.", {}};
  Series left{"left", Ink::kCorrected};
  left.x = {1, 2};
  left.y = {0.5, std::numeric_limits<double>::quiet_NaN()};
  figure.plot.panels.push_back({"", {"h"}, {"deg/h"}, {left}});
  report.sections = {{"one", "First", {Paragraph{"Well."}, table, figure}}};
  return report;
}

TEST(HtmlPage, ContainsAndEscapesAllTexts) {
  const std::string page = html_page(sample());
  EXPECT_THAT(page, HasSubstr("<h1>Gyro &lt;7&gt; &amp; &quot;friends&quot;</h1>"));
  EXPECT_THAT(page, HasSubstr("<b>Table 1.</b> LS model."));
  EXPECT_THAT(page, HasSubstr("Divisor N-1."));
  EXPECT_THAT(page, HasSubstr("0.01194"));
  EXPECT_THAT(
      page, HasSubstr("<figure id=\"fig_ls\">\n<svg role=\"img\" aria-label=\"Residual. 100 s means. Curves: left\""));
  EXPECT_THAT(page, Not(HasSubstr("SIMULATED")));
}

// The files and settings preceded the result.
TEST(HtmlPage, BeginsWithTheConclusion) {
  const std::string page = html_page(sample());
  EXPECT_LT(page.find("Well."), page.find("a,b.csv"));
  EXPECT_THAT(page, HasSubstr("<a href=\"#facts\">Data and settings</a>"));
}

// The Content-Security-Policy also prevents network access and scripts.
TEST(HtmlPage, NeedsNothingFromTheNetworkAndNoScript) {
  std::string page = html_page(sample());
  EXPECT_THAT(page, HasSubstr("content=\"default-src 'none'; style-src 'unsafe-inline'; img-src data:\""));
  const std::string language = " xmlns=\"http://www.w3.org/2000/svg\"";  // a namespace, which is not fetched
  page.erase(page.find(language), language.size());
  for (const char* outside : {"src=", "http://", "https://", "@import", "<script"})
    EXPECT_THAT(page, Not(HasSubstr(outside)));
  EXPECT_THAT(page, Not(testing::ContainsRegex("url\\([^#]")));
}

TEST(HtmlPage, MarksSimulatedDataAtTheTopAndInCaptions) {
  Report report = sample();
  report.simulated = true;
  const std::string page = html_page(report);
  EXPECT_THAT(page, HasSubstr("SIMULATED DATA"));
  std::size_t captions = 0;
  for (std::size_t at = 0; (at = page.find("Simulated data.", at)) != std::string::npos; ++at) ++captions;
  EXPECT_EQ(captions, 2u);
}

TEST(MachineText, HasAllDigitsAndTheSameTextInJson) {
  const auto json = nlohmann::json::parse(json_text(sample()));
  const auto& cell = json["tables"]["ls"]["rows"][0][1];
  EXPECT_EQ(cell["text"], "0.01194");
  EXPECT_DOUBLE_EQ(cell["value"], 0.011941);
  EXPECT_FALSE(json["tables"]["ls"]["rows"][1][1].contains("value"));
  EXPECT_EQ(json["format"], "prism-report");
}

TEST(PlainText, AlignsColumnsByCharactersNotBytes) {
  Table table{"t", "Noise", "Caption.", {{"name", "", false}, {"walk", "deg/√h"}}, {}};
  table.rows = {{Cell("größe"), fixed_cell(0.5, 1)}, {Cell("b"), fixed_cell(std::nullopt, 1)}};
  EXPECT_EQ(plain_text(table), "Noise\nname     walk\n       deg/√h\ngröße     0.5\nb           —\nCaption.\n");
}

TEST(Csv, HasOneFilePerTableWithQuotesAndEmptyUnknownNumbers) {
  const auto files = csv_files(sample());
  ASSERT_EQ(files.size(), 1u);
  EXPECT_EQ(files[0].first, "ls.csv");
  EXPECT_EQ(files[0].second, "Input,After [deg/h]\nT,0.01194\n\"U, \"\"volts\"\"\",\n");
}

TEST(Json, HasTheCurvesOfEveryFigure) {
  const auto panel = nlohmann::json::parse(json_text(sample()))["figures"]["fig_ls"]["panels"][0];
  EXPECT_EQ(panel["y"], "deg/h");
  EXPECT_EQ(panel["curves"][0]["name"], "left");
  EXPECT_EQ(panel["curves"][0]["y"].dump(), "[0.5,null]");
}

TEST(Report, BeginsWithItsWarning) {
  Report report = sample();
  report.warning = "Not a test, \"because\".";
  EXPECT_EQ(nlohmann::ordered_json::parse(json_text(report)).begin().key(), "warning");
  const std::string page = html_page(report);
  EXPECT_LT(page.find("Not a test, &quot;because&quot;."), page.find("<table"));
  EXPECT_THAT(json_text(sample()), Not(HasSubstr("warning")));
}

std::vector<std::string> hostile_names() {
  return {"x'; system \"id > pwned\"; set terminal svg name 'x",
          "`id > pwned`",
          "<img src=x onerror=alert(1)>",
          "\"><img src=x onerror=alert(1)>",
          "x\" onload=\"alert(1)",
          "</script><script>alert(1)</script>",
          "<!--<script>",
          "</svg></figure></text>",
          "]]><b>",
          "=cmd|' /C calc'!A0",
          "+1+cmd",
          "-1+cmd",
          "@SUM(A1)",
          "\t=1+1",
          "\r=1+1",
          "\x1b]0;x\x07\x1b[2J",
          "\xff\xc0\xaf<\x80",
          "\u202e\u2066txt.exe\u200f",
          std::string("nul\0byte", 8),
          "../../etc/passwd",
          "javascript:alert(1)",
          std::string(1 << 20, '<')};
}

/// A report with `name` in all texts that can come from a file; ids are fixed in the program.
Report with(const std::string& name) {
  Report report{name, name, true, name, {{name, name}}, {}, name};
  Table table{"t", name, name, {{name, name, false}, {name, "deg/h"}}, {{name, fixed_cell(-0.5, 3)}}};
  table.rows[0][0].link = "../" + name;
  const std::string few = name.substr(0, 100);  // in a figure: of the program, and short
  Plot plot{2, 200, {{few, {few}, {few}}, {few, {few}, {few}}}};
  plot.panels[0].series = {{few, Ink::kRaw, SeriesStyle::kLine, {1, 2}, {1, 2}},
                           {few, Ink::kModel, SeriesStyle::kPoints, {1, 2}, {1, 2}}};
  plot.panels[1].series = {{few, Ink::kRaw, SeriesStyle::kBand, {1, 2}, {1, 1}, {2, 2}},
                           {few, Ink::kModel, SeriesStyle::kLinePoints, {1}, {1}}};
  Plot single = plot;
  single.panels.pop_back();
  report.sections = {
      {"s", name, {Paragraph{name}, table, Figure{"f", name, name, plot}, Figure{"b", name, name, single}}}};
  return report;
}

std::vector<std::string> elements(const std::string& text) {
  auto found = test::elements_of(text);
  EXPECT_TRUE(found) << text.substr(0, 2000);
  if (!found) return {};
  std::erase_if(*found, [](const std::string& element) { return element.starts_with("a href"); });
  return *found;
}

std::string shown(const std::string& name) { return shortened(name, 80); }

TEST(HostileName, AddsNoElementToThePage) {
  const auto expected = elements(html_page(with("name")));
  for (const std::string& name : hostile_names()) {
    const std::string page = html_page(with(name));
    EXPECT_EQ(elements(page), expected) << shown(name);
    EXPECT_EQ(valid_utf8(page), page) << shown(name);
    for (const char* link : {"href=\"javascript:", "href=\"/", "href=\"http"}) EXPECT_THAT(page, Not(HasSubstr(link)));
  }
}

TEST(HostileName, AddsNoElementToADrawing) {
  const auto plot_of = [](const std::string& name, std::size_t i) {
    return std::get<Figure>(with(name).sections[0].blocks[2 + i]).plot;
  };
  for (const std::size_t i : {0u, 1u}) {
    const auto all = [&](const std::string& name) {
      auto found = elements(draw_svg(plot_of(name, i)));
      std::sort(found.begin(), found.end());
      return found;
    };
    for (const std::string& name : hostile_names()) {
      EXPECT_EQ(all(name), all("name")) << shown(name);
      const std::string svg = draw_svg(plot_of(name, i));
      EXPECT_EQ(valid_utf8(svg), svg);
      EXPECT_THAT(svg, Not(HasSubstr(" id=")));
    }
  }
}

/// The cells of a CSV text by RFC 4180.
std::vector<std::string> cells_of(const std::string& text) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (const char c : text) {
    if (c == '"') {
      quoted = !quoted;
    } else if (!quoted && (c == ',' || c == '\n')) {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  EXPECT_FALSE(quoted);
  return cells;
}

TEST(HostileName, IsTextInAllCellsOfTheCsv) {
  const std::size_t expected = cells_of(csv_files(with("name"))[0].second).size();
  for (const std::string& name : hostile_names()) {
    const auto cells = cells_of(csv_files(with(name))[0].second);
    EXPECT_EQ(cells.size(), expected) << shown(name);
    for (const std::string& cell : cells)
      EXPECT_TRUE(cell.empty() || cell == "-0.500" ||
                  std::string_view("=+-@\t\r").find(cell[0]) == std::string_view::npos)
          << shown(cell);
  }
}

TEST(HostileName, IsEscapedInJsonAndOnTheTerminal) {
  for (const std::string& name : hostile_names()) {
    const auto json = nlohmann::json::parse(json_text(with(name)));
    EXPECT_EQ(json["title"], valid_utf8(name)) << shown(name);
    const std::string text = plain_text(std::get<Table>(with(name).sections[0].blocks[1]));
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 5) << shown(name);
    for (const char c : text) ASSERT_TRUE(c == '\n' || (c != '\x7f' && (static_cast<unsigned char>(c) >= 0x20)));
    EXPECT_EQ(valid_utf8(text), text);
  }
}

}  // namespace
}  // namespace prism::report
