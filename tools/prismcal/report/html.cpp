// SPDX-License-Identifier: MIT
#include "tools/prismcal/report/html.hpp"

#include <fmt/format.h>

#include <cctype>

#include "base/escape.hpp"
#include "tools/prismcal/report/svg_chart.hpp"

namespace prism::report {
namespace {

constexpr const char* kFactsHeading = "Data and settings";

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

/// Text alternative of a figure: title, caption and names of curves.
std::string alternative_text(const Figure& figure) {
  std::string curves;
  for (const Panel& panel : figure.plot.panels) {
    for (const Series& series : panel.series) {
      if (!series.name.empty() && curves.find(series.name) == std::string::npos)
        curves += (curves.empty() ? " Curves: " : ", ") + series.name;
    }
  }
  return fmt::format("{}. {}{}", figure.title, figure.caption, curves);
}

/// Encodes a link within the page or to a relative path: percent-encodes all other characters, so that no link has a
/// scheme. Returns an empty string if `link` begins with a slash or backslash, which could lead to another host.
std::string relative_link(const std::string& link) {
  if (link.starts_with('/') || link.starts_with('\\')) return {};
  std::string result;
  for (const char c : link) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain =
        (byte < 0x80 && std::isalnum(byte) != 0) || std::string_view("._~-/").find(c) != std::string_view::npos;
    result += plain || (c == '#' && result.empty()) ? std::string(1, c) : fmt::format("%{:02X}", byte);
  }
  return result;
}

std::string linked(const Cell& cell) {
  const std::string text = html_text(cell.text), link = relative_link(cell.link);
  return link.empty() ? text : fmt::format("<a href=\"{}\">{}</a>", link, text);
}

/// Content-Security-Policy: no script, no external resources.
constexpr const char* kPolicy = "default-src 'none'; style-src 'unsafe-inline'; img-src data:";

/// Writes the page and numbers tables and figures.
class Page {
 public:
  explicit Page(const Report& report) : report_(report) {}

  std::string write() {
    head();
    for (const Section& section : report_.sections) {
      text_ += fmt::format("<section id=\"{}\">\n<h2>{}</h2>\n", id_or_number(section.id, "section", ++sections_),
                           html_text(section.heading));
      for (const Block& block : section.blocks) std::visit([this](const auto& b) { add(b); }, block);
      text_ += "</section>\n";
    }
    facts();
    text_ += fmt::format("<footer>{}</footer>\n", html_text(report_.tool));
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
        kPolicy, html_text(report_.title), kStyle, html_text(report_.title), html_text(report_.subtitle));
    if (!report_.warning.empty()) text_ += fmt::format("<p class=\"warning\">{}</p>\n", html_text(report_.warning));
    if (report_.simulated) text_ += "<div class=\"simulated\">SIMULATED DATA: no gyro was measured</div>\n";
    text_ += "<nav>\n";
    int number = 0;
    for (const Section& s : report_.sections) {
      text_ += fmt::format("<a href=\"#{}\">{}</a>\n", id_or_number(s.id, "section", ++number), html_text(s.heading));
    }
    if (!report_.facts.empty()) text_ += fmt::format("<a href=\"#facts\">{}</a>\n", kFactsHeading);
    text_ += "</nav>\n</header>\n";
  }

  /// Last: the conclusion comes first.
  void facts() {
    if (report_.facts.empty()) return;
    text_ += fmt::format("<section id=\"facts\">\n<h2>{}</h2>\n<table class=\"facts\">\n", kFactsHeading);
    for (const auto& [name, value] : report_.facts) {
      text_ += fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", html_text(name), html_text(value));
    }
    text_ += "</table>\n</section>\n";
  }

  /// "Table 3. Title. Caption", and "Simulated data." if it is.
  std::string caption(const char* kind, int number, const std::string& title, const std::string& more) const {
    return fmt::format("<b>{} {}.</b> {}.{}{}", kind, number, html_text(title),
                       more.empty() ? "" : " <span class=\"note\">" + html_text(more) + "</span>",
                       report_.simulated ? " <span class=\"note\">Simulated data.</span>" : "");
  }

  void add(const Paragraph& paragraph) {
    text_ += fmt::format("<p class=\"{}\">{}</p>\n", css_class(paragraph.emphasis), html_text(paragraph.text));
  }

  void add(const Table& table) {
    ++tables_;
    text_ +=
        fmt::format("<div class=\"wide\" id=\"{}\">\n<table class=\"data\">\n<caption>{}</caption>\n<thead><tr>",
                    id_or_number(table.id, "table", tables_), caption("Table", tables_, table.title, table.caption));
    for (const Column& column : table.columns) {
      const std::string unit =
          column.unit.empty() ? "" : fmt::format(" <span class=\"unit\">{}</span>", html_text(column.unit));
      text_ +=
          fmt::format("<th class=\"{}\">{}{}</th>", column.number ? "number" : "text", html_text(column.name), unit);
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
    text_ += "</tbody>\n</table>\n";
    if (!table.meaning.empty()) text_ += fmt::format("<p class=\"meaning\">{}</p>\n", html_text(table.meaning));
    text_ += "</div>\n";
  }

  void add(const Figure& figure) {
    std::string svg = draw_svg(figure.plot, ++figures_);
    svg.insert(4, fmt::format(" role=\"img\" aria-label=\"{}\"", html_text(alternative_text(figure))));
    text_ += fmt::format("<figure id=\"{}\">\n{}\n", id_or_number(figure.id, "figure", figures_), svg);
    const std::string meaning =
        figure.meaning.empty() ? "" : fmt::format(" <span class=\"meaning\">{}</span>", html_text(figure.meaning));
    text_ += fmt::format("<figcaption>{}{}</figcaption>\n</figure>\n",
                         caption("Figure", figures_, figure.title, figure.caption), meaning);
  }

  const Report& report_;
  std::string text_;
  int sections_ = 0, tables_ = 0, figures_ = 0;
};

}  // namespace

std::string html_page(const Report& report) { return Page(report).write(); }

}  // namespace prism::report
