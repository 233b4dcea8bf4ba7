// SPDX-License-Identifier: MIT
// Names come from untrusted files. In no report format may a name become an element, a formula, an escape sequence, an
// external link or a file name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "tests/unit/report/markup.hpp"
#include "tools/prismcal/report/html.hpp"
#include "tools/prismcal/report/svg_chart.hpp"
#include "tools/prismcal/report/text_output.hpp"

namespace prism::report {
namespace {

using testing::HasSubstr;
using testing::Not;

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

/// A report with `name` in all texts that can come from a file.
Report with(const std::string& name) {
  Report report{name, name, true, name, {{name, name}}, {}, name};
  Table table{name, name, name, {{name, name, false}, {name, "deg/h"}}, {{text_cell(name), fixed_cell(-0.5, 3)}}};
  table.rows[0][0].link = name;
  Plot plot{2, 200, {{name, {name}, {name}, {name}, {}}, {name, {name}, {name}, {name}, {}}}};
  plot.panels[0].series = {{name, Ink::kRaw, SeriesStyle::kLine, {1, 2}, {1, 2}},
                           {name, Ink::kModel, SeriesStyle::kBars, {1, 2}, {1, 2}, {}, true}};
  plot.panels[1].series = {{name, Ink::kRaw, SeriesStyle::kBand, {1, 2}, {1, 1}, {2, 2}},
                           {name, Ink::kModel, SeriesStyle::kLinePoints, {1}, {1}}};
  Plot single = plot;
  single.panels.pop_back();
  report.sections = {
      {name, name, {Paragraph{name}, table, Figure{name, name, name, plot}, Figure{"b", name, name, single}}}};
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

TEST(HostileName, AddsNoElementOrIdToADrawing) {
  const auto plot_of = [](const std::string& name, std::size_t i) {
    return std::get<Figure>(with(name).sections[0].blocks[2 + i]).plot;
  };
  for (const std::size_t i : {0u, 1u}) {
    const auto all = [&](const std::string& name) {
      auto found = elements(draw_svg(plot_of(name, i), 3));
      std::sort(found.begin(), found.end());
      return found;
    };
    for (const std::string& name : hostile_names()) {
      EXPECT_EQ(all(name), all("name")) << shown(name);
      const std::string svg = draw_svg(plot_of(name, i), 3);
      EXPECT_EQ(valid_utf8(svg), svg);
      EXPECT_LT(svg.size(), 60'000u);
      EXPECT_THAT(svg, HasSubstr("id=\"plot3-0\""));
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
  const std::size_t expected = cells_of(csv_text(with("name"))).size();
  for (const std::string& name : hostile_names()) {
    const auto cells = cells_of(csv_text(with(name)));
    EXPECT_EQ(cells.size(), expected) << shown(name);
    for (const std::string& cell : cells)
      EXPECT_TRUE(cell.empty() || cell == "-0.500" ||
                  std::string_view("=+-@\t\r").find(cell[0]) == std::string_view::npos)
          << shown(cell);
  }
}

TEST(HostileName, IsNotUsedAsAFileName) {
  for (const std::string& name : hostile_names()) {
    const auto files = csv_files(with(name));
    ASSERT_EQ(files.size(), 1u);
    EXPECT_EQ(files[0].first, "table-1.csv") << shown(name);
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

TEST(CellLink, IsRelativeAndPercentEncoded) {
  const auto link_of = [](const std::string& link) {
    Report report = with("name");
    std::get<Table>(report.sections[0].blocks[1]).rows[0][0].link = link;
    const std::string page = html_page(report), begin = "<td class=\"text \"><a href=\"";
    const auto at = page.find(begin);
    return at == std::string::npos
               ? ""
               : page.substr(at + begin.size(), page.find('"', at + begin.size()) - at - begin.size());
  };
  EXPECT_EQ(link_of("#axis2_summary"), "#axis2_summary");
  EXPECT_EQ(link_of("../tasks/0a1b/report/report.html"), "../tasks/0a1b/report/report.html");
  EXPECT_EQ(link_of("a b/ü\"#?"), "a%20b/%C3%BC%22%23%3F");
  EXPECT_EQ(link_of("javascript:alert(1)"), "javascript%3Aalert%281%29");
  EXPECT_EQ(link_of("//host/x"), "");
  EXPECT_EQ(link_of("\\\\host\\x"), "");
}

}  // namespace
}  // namespace prism::report
