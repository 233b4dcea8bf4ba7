// SPDX-License-Identifier: MIT
// A report as data: metadata, tables and figures in sections. Text, HTML, CSV and JSON are written from it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "base/result.hpp"

namespace prism::report {

enum class Emphasis { kNone, kGood, kBad, kWarn, kMuted, kBest };

/// One field of a table. `text` is shown in all formats; `value` is the same number with all digits (JSON only). An
/// unknown number has the text kNothing and no value, never NaN; its CSV field is empty.
inline constexpr const char* kNothing = "\u2014";

struct Cell {
  std::string text;
  std::optional<double> value{};
  Emphasis emphasis = Emphasis::kNone;
  std::string link{};  ///< target of a link in HTML and JSON, of the program, with a relative path; empty: none

  Cell(std::string shown, std::optional<double> number, Emphasis how = Emphasis::kNone)
      : text(std::move(shown)), value(number), emphasis(how) {}
  Cell(std::string shown, Emphasis how = Emphasis::kNone) : Cell(std::move(shown), std::nullopt, how) {}
  Cell(const char* shown, Emphasis how = Emphasis::kNone) : Cell(std::string(shown), how) {}
};

/// The smallest and the largest of values; low > high: none.
struct Range {
  double low = HUGE_VAL, high = -HUGE_VAL;

  /// Ignores a value that is not finite.
  void add(double value) {
    if (std::isfinite(value)) low = std::min(low, value), high = std::max(high, value);
  }
  static Range of(const std::vector<double>& values) {
    Range range;
    for (const double value : values) range.add(value);
    return range;
  }
};

Cell count_cell(std::size_t count);
/// `value` with `decimals` decimals; an em dash if it is nullopt or not finite.
Cell fixed_cell(std::optional<double> value, int decimals, Emphasis emphasis = Emphasis::kNone);
/// `value` with `digits` significant digits, as 1.23e-05 if very small or large.
Cell general_cell(std::optional<double> value, int digits, Emphasis emphasis = Emphasis::kNone);
/// A share in percent with two decimals, for a column whose unit is "%": 0.6119 → 61.19.
Cell percent_cell(std::optional<double> share, Emphasis emphasis = Emphasis::kNone);

struct Column {
  std::string name;
  std::string unit{};  ///< empty: none
  bool number = true;  ///< numbers are right-aligned

  Column(std::string shown, std::string in, bool numeric = true)
      : name(std::move(shown)), unit(std::move(in)), number(numeric) {}
  /// "before [deg/h]": with its unit; "gyro:": a column of text.
  Column(std::string text);
};

/// "gyro: | before [deg/h] | after [deg/h]": the columns of a table.
std::vector<Column> columns(const char* text);

struct Table {
  std::string id;       ///< unique, [a-z0-9_], fixed in the program; key in CSV and JSON, and file name
  std::string title;    ///< without a number: the page adds it
  std::string caption;  ///< basis of the values: divisor, length of means, data
  std::vector<Column> columns;
  std::vector<std::vector<Cell>> rows{};  ///< each with one cell per column
  std::string meaning{};                  ///< one sentence, computed from the values: their meaning for this gyro
};

/// The meaning of a series determines its colour, width and dash in all figures. Inks also differ in lightness or dash,
/// so that a grey print is readable.
enum class Ink {
  kRaw,        ///< measured values: light, wide
  kModel,      ///< predictions of a model: dark, warm
  kCorrected,  ///< corrected values, residuals: dark, cold
  kGuide,      ///< limits and reference lines: thin, grey, dashed
};

enum class SeriesStyle { kLine, kPoints, kOpenPoints, kLinePoints, kBand };

struct Series {
  std::string name;  ///< in the key; empty: not in the key
  Ink ink = Ink::kRaw;
  SeriesStyle form = SeriesStyle::kLine;
  std::vector<double> x{}, y{};
  std::vector<double> high{};  ///< kBand: upper edge (y is the lower)
};

struct Axis {
  std::string label;  ///< with its unit
  bool logarithmic = false;
};

struct Panel {
  std::string title;  ///< "(a) …"; empty: none
  Axis x{}, y{};
  std::vector<Series> series{};
};

/// Panels are arranged in rows of `columns`. A value that is not finite interrupts a line.
struct Plot {
  int columns = 1;
  double panel_height = 260;  ///< pixels, for a width of 960
  std::vector<Panel> panels{};
};

struct Figure {
  std::string id;  ///< like Table::id
  std::string title;
  std::string caption;
  Plot plot{};
  std::string meaning{};  ///< like Table::meaning
};

struct Paragraph {
  std::string text;
  Emphasis emphasis = Emphasis::kNone;
};

using Block = std::variant<Paragraph, Table, Figure>;

struct Section {
  std::string id;  ///< like Table::id
  std::string heading;
  std::vector<Block> blocks{};
};

struct Report {
  std::string title;
  std::string subtitle;
  bool simulated = false;                                  ///< marked at the top of the page and in all captions
  std::string tool;                                        ///< "prismcal 0.3.0"
  std::vector<std::pair<std::string, std::string>> facts;  ///< last page: files, divisor, …
  std::vector<Section> sections;
  std::string warning{};                                     ///< shown before all values; empty: none
  std::vector<std::pair<std::string, std::string>> cover{};  ///< first page: gyro, date, …; a value may be empty
  std::string paper = "A4";                                  ///< of a print, or "letter"
};

/// A report of any length as a page of a few megabytes: its long series and tables reduced, others unchanged. A line
/// becomes its mean, with a band from minimum to maximum, of each of kIntervals intervals of x. Points are thinned to
/// one per cell of a grid, at most kMostPoints. Of a table kMostRows rows remain, or a few less: the first, those with
/// the smallest and the largest value of a column, and others at equal distances. The captions state it. A reduced
/// report stays as it is.
Report reduced(Report report);
/// The same for one of its parts.
Block reduced(Block block);

inline constexpr std::size_t kIntervals = 400, kMostPoints = 700, kMostRows = 400;
/// Series with fewer points, and tables with fewer rows, are unchanged.
inline constexpr std::size_t kLongSeries = 1200;

// The outputs of a report.

/// One file per table, for pandas.read_csv and Excel: (ID.csv, the column line ("name [unit]") and the rows). Quotes
/// fields if needed (RFC 4180).
std::vector<std::pair<std::string, std::string>> csv_files(const Report& report);

/// {"title":…,"simulated":…,"cover":{…},"facts":{…},"tables":{ID:{"title":…,"columns":[…],"rows":[[{"text":…,"value":…}…]…]}…}}.
/// "figures" has each curve of each panel:
/// {ID:{"panels":[{"x":LABEL,"y":LABEL,"curves":[{"name":…,"x":[…],"y":[…]}…]}…]}…}; a gap is null. The "value" of a
/// cell is the number with all digits, "text" that of HTML and CSV; an unknown number has no "value".
std::string json_text(const Report& report);

/// Title, columns with units, rows, caption; each line ends with a newline. Column widths count characters, not bytes.
std::string plain_text(const Table& table);
/// The warning, then all tables and paragraphs, and the meaning of each figure.
std::string plain_text(const Report& report);

/// Returns an SVG element without ids, 960 pixels wide in its own units. Escapes all texts of `plot`, which are of the
/// program and short: title and names of a panel share a line. A value that cannot be drawn interrupts a line.
std::string draw_svg(const Plot& plot);

/// Numbers tables and figures in order. Escapes all texts of `report`, but not the ids.
std::string html_page(const Report& report);

/// Prints a page to a PDF file with Chromium. Errors: it is not installed, or fails; `path` cannot be written.
Result<void> print_pdf(const std::string& html, const std::string& path);

}  // namespace prism::report
