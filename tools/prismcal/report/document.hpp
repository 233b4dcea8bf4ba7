// SPDX-License-Identifier: MIT
// A report as data: facts, tables and figures in sections. HTML, CSV and JSON are three ways to write the same struct.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "tools/prismcal/report/plot.hpp"

namespace prism::report {

enum class Emphasis { kNone, kGood, kBad, kWarn, kMuted, kBest };

/// One field of a table. `text` is what every form of the report shows; `value` is the number behind it, with all its
/// digits (JSON only). A number that does not exist is kNothing and no value, never NaN; CSV leaves its field empty.
inline constexpr const char* kNothing = "\u2014";

struct Cell {
  std::string text;
  std::optional<double> value{};
  Emphasis emphasis = Emphasis::kNone;
  std::string link{};  ///< where HTML and JSON lead to from it; empty: nowhere
};

Cell text_cell(std::string text, Emphasis emphasis = Emphasis::kNone);
/// `value` with `decimals` decimals; an em dash if it is nullopt or not finite.
Cell fixed_cell(std::optional<double> value, int decimals, Emphasis emphasis = Emphasis::kNone);
/// `value` with `digits` significant digits, as 1.23e-05 if it is very small or large.
Cell general_cell(std::optional<double> value, int digits, Emphasis emphasis = Emphasis::kNone);
/// A share in percent with two decimals, for a column whose unit is "%": 0.6119 → 61.19.
Cell percent_cell(std::optional<double> share, Emphasis emphasis = Emphasis::kNone);

struct Column {
  std::string name;
  std::string unit{};  ///< empty: none
  bool number = true;  ///< numbers are right-aligned
};

struct Table {
  std::string id;       ///< unique, [a-z0-9_], written by the program; the CSV's and JSON's key, and the file's name
  std::string title;    ///< without a number: sections count them
  std::string caption;  ///< what an engineer must know to trust it: divisor, length of means, which data
  std::vector<Column> columns;
  std::vector<std::vector<Cell>> rows{};  ///< each as long as columns
};

struct Figure {
  std::string id;  ///< as of a table
  std::string title;
  std::string caption;
  Plot plot;
};

struct Paragraph {
  std::string text;
  Emphasis emphasis = Emphasis::kNone;
};

using Block = std::variant<Paragraph, Table, Figure>;

struct Section {
  std::string id;  ///< as of a table
  std::string heading;
  std::vector<Block> blocks{};
};

struct Report {
  std::string title;
  std::string subtitle;
  bool simulated = false;                                  ///< said on top of the page and in every caption
  std::string tool;                                        ///< "prismcal 0.2.0"
  std::vector<std::pair<std::string, std::string>> facts;  ///< the header table: serial, files, divisor, …
  std::vector<Section> sections;
  std::string warning{};  ///< what must be known before any number; empty: none
};

/// `id` if it is [a-z0-9_-] and not longer than 80 bytes, else "<kind>-<number>": what ids and file names are made of.
std::string id_or_number(const std::string& id, const char* kind, int number);

}  // namespace prism::report
