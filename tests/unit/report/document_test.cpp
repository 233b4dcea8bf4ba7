// SPDX-License-Identifier: MIT
// Report formats: HTML, CSV and JSON have the same numbers, and never NaN.
#include "tools/prismcal/report/document.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "tools/prismcal/report/html.hpp"
#include "tools/prismcal/report/text_output.hpp"

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

Report sample() {
  Report report;
  report.title = "Gyro <7> & \"friends\"";
  report.tool = "prismcal 0.1.0";
  report.facts = {{"files", "a,b.csv"}};
  Table table{"ls", "LS model", "Divisor N-1.", {{"Input", "", false}, {"After", "deg/h"}}, {}};
  table.rows = {{text_cell("T"), fixed_cell(0.011941, 5)}, {text_cell("U, \"volts\""), fixed_cell(std::nullopt, 5)}};
  Figure figure{"fig_ls", "Residual", "100 s means.", {}};
  Series left{"left", Ink::kCorrected};
  left.x = {1, 2};
  left.y = {0.5, std::numeric_limits<double>::quiet_NaN()};
  figure.plot.panels.push_back({"", {"h"}, {"deg/h"}, {}, {left}});
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

TEST(MachineText, QuotesFieldsAndLeavesUnknownNumbersEmpty) {
  EXPECT_EQ(csv_text(sample()),
            "# report,\"Gyro <7> & \"\"friends\"\"\"\n# tool,prismcal 0.1.0\n# fact,files,\"a,b.csv\"\n"
            "\n# table,ls,LS model\nInput,After [deg/h]\nT,0.01194\n\"U, \"\"volts\"\"\",\n");
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
  table.rows = {{text_cell("größe"), fixed_cell(0.5, 1)}, {text_cell("b"), fixed_cell(std::nullopt, 1)}};
  EXPECT_EQ(plain_text(table), "Noise\nname     walk\n       deg/√h\ngröße     0.5\nb           —\nCaption.\n");
}

TEST(Csv, HasOneFilePerTableWithoutCommentLines) {
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
  EXPECT_TRUE(csv_text(report).starts_with("# warning,\"Not a test, \"\"because\"\".\"\n"));
  EXPECT_EQ(nlohmann::ordered_json::parse(json_text(report)).begin().key(), "warning");
  const std::string page = html_page(report);
  EXPECT_LT(page.find("Not a test, &quot;because&quot;."), page.find("<table"));
  EXPECT_THAT(json_text(sample()), Not(HasSubstr("warning")));
}

}  // namespace
}  // namespace prism::report
