// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <vector>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "tools/prismcal/document.hpp"

namespace prism::report {
namespace {

/// CSS of the page for screen and print.
constexpr const char* kStyle = R"css(
:root { color-scheme: light dark; --page: #fff; --ink: #1b2733; --soft: #5b6875; --line: #d9dfe6; --pale: #f4f6f8; --blue: #12385f; --warm: #c2410c; --good: #14613f; --bad: #a11212; --doubt: #8a5a00; --best: #eaf1f8; }
* { box-sizing: border-box; }
html { font: 15px/1.5 "Helvetica Neue", Helvetica, Arial, "Liberation Sans", sans-serif; color: var(--ink); }
body { max-width: 68rem; margin: 0 auto; padding: 2.5rem 1.5rem 4rem; background: var(--page); }
header { border-bottom: 3px solid var(--blue); padding-bottom: 1rem; margin-bottom: 1.5rem; }
h1 { font-size: 1.75rem; line-height: 1.2; margin: 0 0 .3rem; color: var(--blue); letter-spacing: -.01em; }
h2 { font-size: 1.25rem; margin: 2.8rem 0 .6rem; color: var(--blue); border-bottom: 1px solid var(--line); padding-bottom: .25rem; }
p { margin: .5rem 0 .8rem; max-width: 52rem; }
.subtitle { color: var(--soft); font-size: 1.05rem; margin: 0; }
.warning { margin: .7rem 0 0; padding: .4rem .7rem; border-left: 4px solid var(--warm); background: var(--pale); font-weight: 600; }
.simulated { display: inline-block; margin-top: .7rem; padding: .15rem .6rem; border: 1.5px solid var(--warm); color: var(--warm);
  font-weight: 600; letter-spacing: .04em; font-size: .85rem; border-radius: 3px; }
nav { columns: 2; font-size: .92rem; margin: 1rem 0 0; } nav a { color: var(--blue); text-decoration: none; display: block; padding: .08rem 0; }
dl { display: grid; grid-template-columns: 1fr 1fr; column-gap: 1.6rem; font-size: .9rem; margin: .8rem 0 0; }
dl div { display: flex; padding: .2rem 0; border-bottom: 1px dotted var(--line); } dl .long { grid-column: 1 / -1; }
dl dt { flex: 0 0 6.5rem; font-weight: 600; color: var(--soft); } dl dd { margin: 0; overflow-wrap: anywhere; }
figure { max-width: 62rem; margin: 1.6rem 0 2.2rem; break-inside: avoid; }
figure svg { display: block; width: 100%; height: auto; }
figure svg text { font-family: inherit !important; }
figcaption, caption { font-size: .9rem; color: var(--ink); text-align: left; }
figcaption { margin-top: .4rem; max-width: 52rem; } caption { margin-bottom: .4rem; caption-side: top; }
figcaption b, caption b { color: var(--blue); } .note { color: var(--soft); }
.wide { overflow-x: auto; margin: 1.4rem 0 2rem; break-inside: avoid; }
table.data { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; min-width: 50%; }
table.data th { font-weight: 600; text-align: left; padding: .35rem .5rem; border-top: 2px solid var(--ink); border-bottom: 1px solid var(--ink); vertical-align: bottom; }
table.data td { padding: .26rem .5rem; border-bottom: 1px solid var(--line); white-space: nowrap; }
table.data .long { white-space: normal; }
table.data tr:last-child td { border-bottom: 2px solid var(--ink); }
table.data .number { text-align: right; } table.data .unit { display: block; font-weight: 400; color: var(--soft); font-size: .82rem; }
.meaning { font-weight: 600; } p.meaning { font-size: .9rem; margin: .4rem 0 0; } figcaption .meaning { display: block; margin-top: .2rem; }
.good { color: var(--good); font-weight: 600; } .bad { color: var(--bad); font-weight: 700; } .warn { color: var(--doubt); font-weight: 600; }
.muted { color: var(--soft); } .best { font-weight: 700; background: var(--best); }
p.warn, p.bad, p.good { border-left: 3px solid; padding-left: .8rem; font-weight: 400; }
footer { margin-top: 3rem; padding-top: .6rem; border-top: 1px solid var(--line); color: var(--soft); font-size: .85rem; }
/* On a dark screen the page is dark; a figure keeps its white paper, on which its inks were chosen. */
@media screen and (prefers-color-scheme: dark) {
  :root { --page: #14191f; --ink: #e3e8ee; --soft: #a3b0bd; --line: #33404d; --pale: #1d252e; --blue: #8fbbe8; --warm: #f59e6c; --good: #6fce9f; --bad: #ff9a94;
    --doubt: #e8b75c; --best: #22344a; }
  figure svg { background: #fff; border-radius: 4px; }
}
@media print {
  html { font-size: 9pt; line-height: 1.35; } body { max-width: none; padding: 0; } nav, footer { display: none; }
  header { padding-bottom: .4rem; margin-bottom: .8rem; } h2 { margin: 1.4rem 0 .4rem; break-after: avoid; } a { color: inherit; }
  p { max-width: none; orphans: 3; widows: 3; } .wide { overflow: visible; margin: .8rem 0 1rem; break-inside: auto; }
  table.data { font-size: .8rem; min-width: 0; } table.data td, table.data th { padding: .12rem .34rem; } table.data td { white-space: normal; }
  table.data .number { white-space: nowrap; } tr, caption, p { break-inside: avoid; } p.meaning { break-before: avoid; } caption { break-after: avoid; } thead { display: table-header-group; break-after: avoid; } tbody tr:nth-child(-n+4), tbody tr:nth-last-child(-n+3) { break-before: avoid; }
  figure { margin: .8rem 0 1rem; max-width: none; } figcaption { max-width: none; } figure svg { width: auto; max-width: 100%; max-height: 58mm; margin: 0 auto; }
  * { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
}
@page { margin: 16mm 14mm 17mm; @bottom-right { content: "page " counter(page) " of " counter(pages); color: #5b6875; font: 8pt sans-serif; } }
@media (max-width: 45rem) { body { padding: 1.2rem .8rem; } nav { columns: 1; } table.data td, table.data th { padding: .22rem .45rem; } }
)css";

constexpr const char* kFactsHeading = "Data and settings";

const char* css_class(Emphasis emphasis) {
  static constexpr const char* kClasses[] = {"", "good", "bad", "warn", "muted", "best"};  // in the order of Emphasis
  return kClasses[static_cast<std::size_t>(emphasis)];
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

std::string linked(const Cell& cell) {
  const std::string text = html_text(cell.text);
  return cell.link.empty() ? text : fmt::format("<a href=\"{}\">{}</a>", html_text(cell.link), text);
}

/// Content-Security-Policy: no script, no external resources.
constexpr const char* kPolicy = "default-src 'none'; style-src 'unsafe-inline'; img-src data:";

/// Cells of a column of text that are longer wrap.
constexpr std::size_t kLongText = 36;
/// A table with more columns after the first is split, so that a printed page shows all.
constexpr std::size_t kOthers = 11;

/// Writes the page and numbers tables and figures.
class Page {
 public:
  explicit Page(const Report& report) : report_(report) {}

  std::string write() {
    head();
    for (const Section& section : report_.sections) {
      text_ += fmt::format("<section id=\"{}\">\n<h2>{}</h2>\n", section.id, html_text(section.heading));
      for (const Block& block : section.blocks) std::visit([this](const auto& b) { add(b); }, block);
      text_ += "</section>\n";
    }
    if (!report_.facts.empty()) {  // last: the conclusion comes first
      text_ += fmt::format("<section id=\"facts\">\n<h2>{}</h2>\n", kFactsHeading);
      list(report_.facts);
      text_ += "</section>\n";
    }
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
        kPolicy, html_text(report_.title), kStyle + fmt::format("@page {{ size: {}; }}\n", report_.paper),
        html_text(report_.title), html_text(report_.subtitle));
    if (!report_.cover.empty()) list(report_.cover);
    if (!report_.warning.empty()) text_ += fmt::format("<p class=\"warning\">{}</p>\n", html_text(report_.warning));
    if (report_.simulated) text_ += "<div class=\"simulated\">SIMULATED DATA: no gyro was measured</div>\n";
    text_ += "<nav>\n";
    for (const Section& s : report_.sections)
      text_ += fmt::format("<a href=\"#{}\">{}</a>\n", s.id, html_text(s.heading));
    if (!report_.facts.empty()) text_ += fmt::format("<a href=\"#facts\">{}</a>\n", kFactsHeading);
    text_ += "</nav>\n</header>\n";
  }

  /// Two columns; a long value has a row of its own.
  void list(const std::vector<std::pair<std::string, std::string>>& pairs) {
    text_ += "<dl>\n";
    for (const auto& [name, value] : pairs)
      text_ += fmt::format("<div class=\"{}\"><dt>{}</dt><dd>{}</dd></div>\n", value.size() > 50 ? "long" : "",
                           html_text(name), html_text(value));
    text_ += "</dl>\n";
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
    text_ += fmt::format("<div class=\"wide\" id=\"{}\">\n", table.id);
    std::string shown = caption("Table", tables_, table.title, table.caption);
    for (std::size_t begin = 1; begin == 1 || begin < table.columns.size(); begin += kOthers) {
      std::vector<std::size_t> part = {0};
      for (std::size_t c = begin; c < std::min(begin + kOthers, table.columns.size()); ++c) part.push_back(c);
      add_part(table, part, shown);
      shown = fmt::format("<b>Table {}</b>, continued", tables_);
    }
    if (!table.meaning.empty()) text_ += fmt::format("<p class=\"meaning\">{}</p>\n", html_text(table.meaning));
    text_ += "</div>\n";
  }

  void add_part(const Table& table, const std::vector<std::size_t>& part, const std::string& caption) {
    text_ += fmt::format("<table class=\"data\">\n<caption>{}</caption>\n<thead><tr>", caption);
    for (const std::size_t c : part) {
      const Column& column = table.columns[c];
      const std::string unit =
          column.unit.empty() ? "" : fmt::format(" <span class=\"unit\">{}</span>", html_text(column.unit));
      text_ +=
          fmt::format("<th class=\"{}\">{}{}</th>", column.number ? "number" : "text", html_text(column.name), unit);
    }
    text_ += "</tr></thead>\n<tbody>\n";
    for (const auto& row : table.rows) {
      text_ += "<tr>";
      for (const std::size_t c : part) {
        if (c >= row.size()) continue;
        const char* kind = table.columns[c].number ? "number" : row[c].text.size() > kLongText ? "text long" : "text";
        text_ += fmt::format("<td class=\"{} {}\">{}</td>", kind, css_class(row[c].emphasis), linked(row[c]));
      }
      text_ += "</tr>\n";
    }
    text_ += "</tbody>\n</table>\n";
  }

  void add(const Figure& figure) {
    ++figures_;
    std::string svg = draw_svg(figure.plot);
    svg.insert(4, fmt::format(" role=\"img\" aria-label=\"{}\"", html_text(alternative_text(figure))));
    text_ += fmt::format("<figure id=\"{}\">\n{}\n", figure.id, svg);
    const std::string meaning =
        figure.meaning.empty() ? "" : fmt::format(" <span class=\"meaning\">{}</span>", html_text(figure.meaning));
    text_ += fmt::format("<figcaption>{}{}</figcaption>\n</figure>\n",
                         caption("Figure", figures_, figure.title, figure.caption), meaning);
  }

  const Report& report_;
  std::string text_;
  int tables_ = 0, figures_ = 0;
};

}  // namespace

std::string html_page(const Report& report) { return Page(report).write(); }

namespace {

/// Runs a program of PATH, without input and output. Returns its status as of waitpid(), or -1 if it does not exist.
int run_quietly(const char* program, std::vector<std::string> options) {
  std::vector<char*> words = {const_cast<char*>(program)};
  for (std::string& option : options) words.push_back(option.data());
  words.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_RDWR, 0);
  pid_t pid = 0;
  int status = -1;
  if (::posix_spawnp(&pid, program, &actions, nullptr, words.data(), environ) == 0) {
    while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
    }
  }
  posix_spawn_file_actions_destroy(&actions);
  return status;
}

}  // namespace

Result<void> print_pdf(const std::string& html, const std::string& path) {
  std::error_code error;
  std::string work = (std::filesystem::temp_directory_path(error) / "prismcal-XXXXXX").string();
  if (::mkdtemp(work.data()) == nullptr) return make_error(work, std::strerror(errno));
  const std::string page = work + "/report.html", made = work + "/report.pdf";
  Result<void> done = write_text_file(page, html);
  if (done) {
    const int status =
        run_quietly("chromium", {"--headless", "--disable-gpu", "--no-pdf-header-footer", "--disable-crash-reporter",
                                 ::geteuid() == 0 ? "--no-sandbox" : "--no-first-run",  // it refuses root with one
                                 "--user-data-dir=" + work + "/profile", "--print-to-pdf=" + made, page});
    if (status == -1)
      done = make_error("--pdf",
                        "found no Chromium, expected it installed; or print report.html (--out) with any browser");
    else if (status != 0 || !std::filesystem::exists(made, error))
      done =
          make_error("--pdf", fmt::format("Chromium ended with status {} and made no PDF; print report.html", status));
    else if (!std::filesystem::copy_file(made, path, std::filesystem::copy_options::overwrite_existing, error))
      done = make_error(path, error.message());
  }
  std::filesystem::remove_all(work, error);
  return done;
}

}  // namespace prism::report
