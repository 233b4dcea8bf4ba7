// SPDX-License-Identifier: MIT
#include "tools/prismcal/report/html.hpp"

#include <fmt/format.h>

#include "tools/prismcal/report/chart_json.hpp"

namespace prism::report {
namespace {

const char* css_class(Emphasis emphasis) {
  switch (emphasis) {
    case Emphasis::kNone:
      return "";
    case Emphasis::kGood:
      return "good";
    case Emphasis::kBad:
      return "bad";
    case Emphasis::kWarn:
      return "warn";
    case Emphasis::kMuted:
      return "muted";
    case Emphasis::kBest:
      return "best";
  }
  return "";
}

/// A figure for those who do not see it: what it is, and which curves are in it.
std::string in_words(const Figure& figure) {
  std::string curves;
  for (const Panel& panel : figure.plot.panels) {
    for (const Series& series : panel.series) {
      if (!series.name.empty() && curves.find(series.name) == std::string::npos)
        curves += (curves.empty() ? " Curves: " : ", ") + series.name;
    }
  }
  return fmt::format("{}. {}{}", figure.title, figure.caption, curves);
}

std::string linked(const Cell& cell) {
  const std::string text = html_escaped(cell.text);
  return cell.link.empty() ? text : fmt::format("<a href=\"{}\">{}</a>", html_escaped(cell.link), text);
}

/// Nothing from anywhere else, and no script but ours.
std::string policy() {
  return fmt::format("default-src 'none'; style-src 'unsafe-inline'; img-src data:; script-src '{}'", kChartScriptHash);
}

/// Writes the page from top to bottom, counting tables and figures.
class Page {
 public:
  Page(const Report& report, const Draw& draw) : report_(report), draw_(draw) {}

  Result<std::string> write() {
    head();
    for (const Section& section : report_.sections) {
      text_ += fmt::format("<section id=\"{}\">\n<h2>{}</h2>\n", section.id, html_escaped(section.heading));
      for (const Block& block : section.blocks) {
        const auto done = std::visit([this](const auto& b) { return add(b); }, block);
        if (!done) return tl::unexpected(done.error());
      }
      text_ += "</section>\n";
    }
    text_ += fmt::format("<footer>{}</footer>\n", html_escaped(report_.tool));
    if (charts_ > 0) text_ += fmt::format("<script>{}</script>\n", kChartScript);
    text_ += "</body>\n</html>\n";
    return std::move(text_);
  }

 private:
  void head() {
    text_ += fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, "
        "initial-scale=1\">\n<meta http-equiv=\"Content-Security-Policy\" "
        "content=\"{}\">\n<title>{}</title>\n<style>{}</style>\n"
        "</head>\n<body>\n<header>\n<h1>{}</h1>\n<p class=\"subtitle\">{}</p>\n",
        policy(), html_escaped(report_.title), kStyle, html_escaped(report_.title), html_escaped(report_.subtitle));
    if (!report_.warning.empty()) text_ += fmt::format("<p class=\"warning\">{}</p>\n", html_escaped(report_.warning));
    if (report_.simulated) text_ += "<div class=\"simulated\">SIMULATED DATA: no gyro was measured</div>\n";
    text_ += "<nav>\n";
    for (const Section& s : report_.sections)
      text_ += fmt::format("<a href=\"#{}\">{}</a>\n", s.id, html_escaped(s.heading));
    text_ += "</nav>\n</header>\n<table class=\"facts\">\n";
    for (const auto& [name, value] : report_.facts) {
      text_ += fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", html_escaped(name), html_escaped(value));
    }
    text_ += "</table>\n";
  }

  /// "Table 3. Title. Caption", with the word simulated where it belongs.
  std::string caption(const char* kind, int number, const std::string& title, const std::string& more) const {
    return fmt::format("<b>{} {}.</b> {}.{}{}", kind, number, html_escaped(title),
                       more.empty() ? "" : " <span class=\"note\">" + html_escaped(more) + "</span>",
                       report_.simulated ? " <span class=\"note\">Simulated data.</span>" : "");
  }

  Result<void> add(const Paragraph& paragraph) {
    text_ += fmt::format("<p class=\"{}\">{}</p>\n", css_class(paragraph.emphasis), html_escaped(paragraph.text));
    return {};
  }

  Result<void> add(const Table& table) {
    text_ += fmt::format("<div class=\"wide\" id=\"{}\">\n<table class=\"data\">\n<caption>{}</caption>\n<thead><tr>",
                         table.id, caption("Table", ++tables_, table.title, table.caption));
    for (const Column& column : table.columns) {
      const std::string unit =
          column.unit.empty() ? "" : fmt::format(" <span class=\"unit\">{}</span>", html_escaped(column.unit));
      text_ +=
          fmt::format("<th class=\"{}\">{}{}</th>", column.number ? "number" : "text", html_escaped(column.name), unit);
    }
    text_ += "</tr></thead>\n<tbody>\n";
    for (const auto& row : table.rows) {
      text_ += "<tr>";
      for (std::size_t i = 0; i < row.size(); ++i) {
        const bool number = i < table.columns.size() && table.columns[i].number;
        const char* kind = number ? "number" : row[i].text.size() > 36 ? "text long" : "text";
        text_ += fmt::format("<td class=\"{} {}\">{}</td>", kind, css_class(row[i].emphasis), linked(row[i]));
      }
      text_ += "</tr>\n";
    }
    text_ += "</tbody>\n</table>\n</div>\n";
    return {};
  }

  Result<void> add(const Figure& figure) {
    auto svg = draw_(figure.plot, figure.id);
    if (!svg) return tl::unexpected(svg.error());
    if (svg->starts_with("<svg"))
      svg->insert(4, fmt::format(" role=\"img\" aria-label=\"{}\"", html_escaped(in_words(figure))));
    text_ += fmt::format("<figure id=\"{}\">\n{}\n", figure.id, *svg);
    if (can_be_charted(figure.plot)) {
      text_ += fmt::format("<script type=\"application/json\">{}</script>\n", chart_json(figure.plot));
      ++charts_;
    }
    text_ += fmt::format("<figcaption>{}</figcaption>\n</figure>\n",
                         caption("Figure", ++figures_, figure.title, figure.caption));
    return {};
  }

  const Report& report_;
  const Draw& draw_;
  std::string text_;
  int tables_ = 0, figures_ = 0, charts_ = 0;
};

}  // namespace

std::string html_escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

Result<std::string> html_page(const Report& report, const Draw& draw) { return Page(report, draw).write(); }

}  // namespace prism::report
