// SPDX-License-Identifier: MIT
#include "tools/prismcal/tables/dialect.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>

#include "base/escape.hpp"
#include "base/outside_text.hpp"
#include "tools/prismcal/tables/cell.hpp"
#include "tools/prismcal/tables/date_text.hpp"
#include "tools/prismcal/tables/reading.hpp"
#include "tools/prismcal/tables/text_lines.hpp"

namespace prism::tables {
namespace {

constexpr std::size_t kSampleLines = 2000, kSampleBytes = 1u << 19;

constexpr std::array<std::pair<const char*, char>, 6> kSeparators = {
    {{"tab", '\t'}, {"semicolon", ';'}, {"bar", '|'}, {"comma", ','}, {"blank", ' '}, {"none", '\0'}}};

struct Sample {
  std::vector<SampleLine> lines;
  std::vector<SampleLine> comments;
  std::vector<SampleLine> labview_units;  ///< "Y_Unit_Label", and the unit of each further column
  std::string encoding;
  char stated_separator = 'x';  ///< of "sep=;"; 'x': none
};

Result<Sample> read_sample(const std::string& path, const TableOptions& options) {
  auto lines = TextLines::open(path, options.encoding);
  if (!lines) return tl::unexpected<Error>(lines.error());
  Sample sample;
  std::size_t bytes = 0;
  while (sample.lines.size() < kSampleLines && bytes < kSampleBytes && lines->next()) {
    const std::string_view line = lines->line();
    bytes += line.size() + 1;
    if (sample.lines.empty() && line.starts_with("sep=") && line.size() == 5) {
      sample.stated_separator = line[4];
    } else if (is_comment(line)) {
      sample.comments.push_back({lines->number(), std::string(line), true});
    } else if (line.starts_with("***End_of_Header***")) {
      sample.lines.clear();
    } else if (line.starts_with("Y_Unit_Label")) {
      sample.labview_units = {{lines->number(), std::string(line), lines->ended()}};
    } else {
      sample.lines.push_back({lines->number(), std::string(line), lines->ended()});
    }
  }
  if (auto good = lines->finish(); !good) return tl::unexpected<Error>(good.error());
  sample.encoding = lines->encoding();
  return sample;
}

Result<std::vector<char>> separators_of(const TableOptions& options, char stated) {
  if (options.separator.empty() && stated != 'x') return std::vector<char>{stated};
  std::vector<char> all;
  for (const auto& [name, separator] : kSeparators) {
    if (options.separator == name || (options.separator.size() == 1 && options.separator[0] == separator))
      return std::vector<char>{separator};
    all.push_back(separator);
  }
  if (options.separator == "\\t") return std::vector<char>{'\t'};
  if (options.separator.empty()) return all;
  if (options.separator.size() == 1 && options.separator[0] > ' ' && options.separator != "\"")
    return std::vector<char>{options.separator[0]};
  return make_error("--separator", fmt::format("found \"{}\", expected comma, semicolon, tab, blank, bar, none or one "
                                               "character",
                                               options.separator));
}

Result<std::vector<char>> decimals_of(const TableOptions& options) {
  if (options.decimal.empty()) return std::vector<char>{'.', ','};
  if (options.decimal == "." || options.decimal == "point") return std::vector<char>{'.'};
  if (options.decimal == "," || options.decimal == "comma") return std::vector<char>{','};
  return make_error("--decimal", fmt::format("found \"{}\", expected \".\" or \",\"", options.decimal));
}

Error both_readings(const std::string& path, const Reading& a, const Reading& b, const char* option) {
  return Error{
      fmt::format("{}:{}", path, a.first().number),
      fmt::format("two readings are possible: {} or {}; state {}", a.first_row_text(), b.first_row_text(), option)};
}

/// The better of two readings; the separators are in the order of preference.
bool better(const Reading& a, const Reading& b) {
  if (a.clean() != b.clean()) return a.clean();
  if (a.share() != b.share()) return a.share() > b.share();
  return false;
}

/// Rows such as "1,2" below names such as "a,b,c": by the names, the comma separates; by the widths, it does not.
bool has_names_with_commas(const Reading& reading) {
  return reading.decimal() == ',' && reading.width() == 1 && reading.has_names() &&
         reading.names()[0].find(',') != std::string::npos;
}

/// A separator that is in no row reads the same as none.
bool usable(const Reading& reading, const std::vector<Reading>& all) {
  return reading.good() && (reading.width() > 1 || reading.separator() == 0 || all.size() <= 2);
}

/// The reading to use. Errors: none has a number; two are equally good and differ.
Result<const Reading*> choose(const std::string& path, const std::vector<Reading>& readings,
                              const TableOptions& options) {
  const Reading* best = nullptr;
  for (const Reading& reading : readings) {
    if (!usable(reading, readings)) continue;
    // Runs of blanks also separate "date time" and "value, value": only if no other character does.
    if (reading.separator() == ' ' && best && best->width() > 1 && best->clean()) continue;
    if (!best || better(reading, *best)) best = &reading;
  }
  if (!best) return nullptr;
  for (const Reading& other : readings) {
    const bool rival =
        &other != best && usable(other, readings) && other.clean() && best->clean() && other.differs_from(*best);
    if (!rival || (other.separator() == ' ' && best->width() > 1)) continue;
    const bool by_names = best->has_names() && best->names_line_has(best->separator());
    if (best->separator() != other.separator() && (by_names || best->separator() == '\t')) continue;
    if (other.has_names() && !best->has_names() && !has_names_with_commas(other)) return &other;
    if (best->has_names() && !other.has_names() && !has_names_with_commas(*best)) continue;
    return tl::unexpected<Error>(both_readings(
        path, *best, other, best->separator() == other.separator() ? "--decimal" : "--separator or --decimal"));
  }
  if (options.decimal.empty() && options.separator.empty() && has_names_with_commas(*best)) {
    for (const Reading& other : readings) {
      if (other.separator() == ',' && other.decimal() == '.' && other.good())
        return tl::unexpected<Error>(both_readings(path, *best, other, "--separator or --decimal"));
    }
  }
  if (options.decimal.empty() && best->decimal() == ',' && best->only_groups())
    return tl::unexpected<Error>(
        Error{fmt::format("{}:{}", path, best->first().number),
              fmt::format("two readings are possible: {} or {}; state --decimal , or --decimal .",
                          best->first_row_text(), best->first_row_text_of_groups())});
  return best;
}

/// The units of the columns that the header of a LabVIEW measurement file states.
std::vector<std::string> labview_units(const Sample& sample, Dialect& dialect) {
  const auto rows = split_sample(sample.labview_units, dialect.separator);
  if (rows.empty()) return {};
  std::vector<std::string> units = rows[0].cells;
  units[0].clear();
  std::replace_if(
      units.begin(), units.end(), [](const std::string& unit) { return !is_unit_cell(unit); }, "");
  dialect.units_line = rows[0].number;
  return units;
}

Result<void> name_columns(const std::string& path, const Reading& reading, const Sample& sample, Dialect& dialect) {
  std::vector<std::string> names = reading.names(), units = reading.units();
  if (units.empty()) units = labview_units(sample, dialect);
  for (std::size_t i = 0; i < dialect.width; ++i) {
    const std::string where = fmt::format("{}:{}", path, dialect.header_line);
    std::string name = i < names.size() ? names[i] : "";
    std::replace(name.begin(), name.end(), '\n', ' ');
    if (auto good = check_text(TextRule::kText, name, where); !good) return good;
    dialect.columns.push_back(read_header(name, i < units.size() ? units[i] : ""));
    Header& header = dialect.columns.back();
    const Header by_name = read_header(name);
    if (by_name.unit && by_name.stated && header.unit && header.unit != by_name.unit)
      return make_error(where, fmt::format("column {}: found the unit {} in line {}, expected {} as in its name", name,
                                           header.unit->name, dialect.units_line, by_name.unit->name));
    if (header.text.empty()) header.text = header.name = std::to_string(i + 1);
    for (std::size_t j = 0; j < i; ++j) {
      if (dialect.columns[j].text == header.text)
        return make_error(where, fmt::format("found column \"{}\" twice", name));
    }
  }
  return {};
}

}  // namespace

bool is_comment(std::string_view line) {
  while (line.starts_with(' ')) line.remove_prefix(1);
  if (line.starts_with('%') || line.starts_with("//")) return true;
  if (!line.starts_with('#')) return false;
  constexpr std::array<std::string_view, 6> kExcel = {"#NUM!", "#N/A", "#VALUE!", "#DIV/0!", "#REF!", "#WERT!"};
  return std::none_of(kExcel.begin(), kExcel.end(), [&](std::string_view word) { return line.starts_with(word); });
}

Result<Dialect> detect_dialect(const std::string& path, const TableOptions& options) {
  auto sample = read_sample(path, options);
  if (!sample) return tl::unexpected<Error>(sample.error());
  const auto separators = separators_of(options, sample->stated_separator);
  if (!separators) return tl::unexpected<Error>(separators.error());
  const auto decimals = decimals_of(options);
  if (!decimals) return tl::unexpected<Error>(decimals.error());
  std::vector<Reading> readings;
  for (const char separator : *separators) {
    const auto rows = split_sample(sample->lines, separator);
    for (const char decimal : *decimals)
      readings.emplace_back(rows, separator, decimal, sample->comments, options.header_row);
  }
  const auto chosen = choose(path, readings, options);
  if (!chosen) return tl::unexpected<Error>(chosen.error());
  if (!*chosen) return make_error(path, no_numbers_text(sample->lines, sample->comments));
  const Reading& reading = **chosen;
  if (auto good = reading.check_names(path); !good) return tl::unexpected<Error>(good.error());
  Dialect dialect;
  dialect.encoding = sample->encoding;
  dialect.separator = reading.separator();
  dialect.decimal = reading.decimal();
  dialect.header_line = reading.names_line();
  dialect.units_line = reading.units_line();
  dialect.first_line = reading.first().number;
  dialect.trailing = reading.trailing();
  dialect.width = reading.width();
  dialect.sample = reading.data();
  if (auto good = name_columns(path, reading, *sample, dialect); !good) return tl::unexpected<Error>(good.error());
  return dialect;
}

std::string Dialect::separator_text() const {
  for (const auto& [name, character] : kSeparators) {
    if (character == separator) return name;
  }
  return fmt::format("\"{}\"", separator);
}

std::string Dialect::text() const {
  std::string text = encoding;
  if (width > 1) text += fmt::format(", separator {}", separator_text());
  text += decimal == ',' ? ", decimal comma" : ", decimal point";
  text += header_line > 0 ? fmt::format(", names in line {}", header_line) : ", no names";
  if (units_line > 0) text += fmt::format(", units in line {}", units_line);
  return text;
}

}  // namespace prism::tables
