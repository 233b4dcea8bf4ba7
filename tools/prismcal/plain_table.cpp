// SPDX-License-Identifier: MIT
#include "tools/prismcal/plain_table.hpp"

#include <fmt/format.h>
#include <utf8.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "base/escape.hpp"
#include "base/outside_text.hpp"
#include "base/plain_text.hpp"
#include "base/text_number.hpp"
#include "compensation/sample.hpp"

namespace prism::tables {
namespace {

constexpr std::size_t kFirstRows = 100;
constexpr const char* kImportAdvice = "; prism-import reads tables of other programs";

bool is_digit(char c) { return c >= '0' && c <= '9'; }

bool is_missing(std::string_view cell) {
  if (cell.empty()) return true;
  if (cell.front() == '-' || cell.front() == '+') cell.remove_prefix(1);
  return cell.size() == 3 && lower(cell) == "nan";
}

/// Latin-1 as UTF-8.
std::string from_latin1(std::string_view bytes) {
  std::string text;
  for (const char c : bytes)
    utf8::append(static_cast<char32_t>(static_cast<unsigned char>(c)), std::back_inserter(text));
  return text;
}

/// The separator of a line: the first of tab, semicolon and comma that it has outside quotes; 0: none.
char separator_of(std::string_view line) {
  for (const char separator : {'\t', ';', ','}) {
    bool quoted = false;
    for (const char c : line) {
      quoted = quoted != (c == '"');
      if (c == separator && !quoted) return separator;
    }
  }
  return 0;
}

/// True for "1.234": one group of three digits, no leading zero.
bool is_group(std::string_view cell, char mark) {
  const std::size_t at = cell.find(mark);
  return at >= 1 && at <= 3 && cell.size() == at + 4 && cell[0] != '0' && std::ranges::count(cell, mark) == 1 &&
         std::ranges::all_of(cell, [&](char c) { return is_digit(c) || c == mark; });
}

/// A file of another program that is not a plain table, by its first bytes.
struct Known {
  std::string_view begin;
  const char* what;
};

using std::string_view_literals::operator""sv;

constexpr std::array<Known, 17> kKnown = {{{"PK\x03\x04"sv, "an Excel or other ZIP file (.xlsx)"},
                                           {"\xD0\xCF\x11\xE0"sv, "an old Excel file (.xls)"},
                                           {"MATLAB 5.0 MAT-file"sv, "a MATLAB file (.mat)"},
                                           {"MATLAB 7.3 MAT-file"sv, "a MATLAB file (.mat)"},
                                           {"\x89HDF\r\n\x1A\n"sv, "a MATLAB or other HDF5 file"},
                                           {"TDSm"sv, "a TDMS file of LabVIEW"},
                                           {"ULog\x01\x12\x35"sv, "a ULog of PX4"},
                                           {"#ROSBAG"sv, "a bag of ROS"},
                                           {"SQLite format 3"sv, "an SQLite file (a bag of ROS 2)"},
                                           {"\x89MCAP0\r\n"sv, "an MCAP file (a bag of ROS 2)"},
                                           {"\x1F\x8B"sv, "compressed by gzip"},
                                           {"\xFD\x37zXZ"sv, "compressed by xz"},
                                           {"PAR1"sv, "a Parquet file"},
                                           {"%PDF"sv, "a PDF document"},
                                           {"LabVIEW Measurement"sv, "a LabVIEW measurement file (.lvm)"},
                                           {"\xFF\xFE"sv, "UTF-16 or UTF-32 text"},
                                           {"\xFE\xFF"sv, "UTF-16 text"}}};

tl::unexpected<Error> refusal(std::string where, const std::string& what) {
  return make_error(std::move(where), what + kImportAdvice);
}

}  // namespace

Result<std::string> foreign_file(const std::string& path) {
  auto in = FileReader::open(path);
  if (!in) return tl::unexpected<Error>(in.error());
  std::array<char, 32> bytes{};
  const std::string_view first(bytes.data(), in->read(bytes));
  for (const Known& known : kKnown) {
    if (first.starts_with(known.begin)) return known.what;
  }
  const auto is_letter = [](char c) { return c >= ' ' && c <= '~'; };
  for (const std::size_t zero : {0, 1}) {  // UTF-16 without a mark
    if (first.size() > 3 && first[zero] == 0 && first[zero + 2] == 0 && is_letter(first[1 - zero]) &&
        is_letter(first[3 - zero]))
      return "UTF-16 text";
  }
  return std::string();
}

std::optional<double> number_in(std::string_view cell, char decimal) {
  constexpr std::size_t kMostChars = 64;
  if (cell.starts_with('+')) {
    cell.remove_prefix(1);
    if (cell.starts_with('-')) return std::nullopt;
  }
  if (decimal == '.') return cell.size() <= kMostChars ? parse_number<double>(cell) : std::nullopt;
  std::array<char, kMostChars> digits;
  if (cell.size() > digits.size() || cell.find('.') != std::string_view::npos) return std::nullopt;
  std::replace_copy(cell.begin(), cell.end(), digits.begin(), ',', '.');
  return parse_number<double>({digits.data(), cell.size()});
}

void GroupWatch::see(std::string_view cell) {
  if (shown_) return;
  if (cell.starts_with('-') || cell.starts_with('+')) cell.remove_prefix(1);
  const bool integer = !cell.empty() && cell.size() <= 3 && std::ranges::all_of(cell, is_digit);
  const bool group = is_group(cell, decimal_);
  int number = 0;  // as a group
  if (integer || group)
    std::ranges::for_each(cell, [&](char c) { number = c == decimal_ ? number : 10 * number + (c - '0'); });
  if (integer) largest_integer_ = std::max(largest_integer_, number);
  if (group) least_group_ = std::min(least_group_, number);
  if (group && group_.empty()) group_ = cell;
  shown_ = !integer && !group && !is_missing(cell);
}

Result<PlainTable> PlainTable::open(const std::string& path, const TableOptions& options) {
  if (!options.decimal.empty() && options.decimal != "." && options.decimal != ",")
    return make_error("--decimal", fmt::format("found \"{}\", expected \".\" or \",\"", options.decimal));
  const auto foreign = foreign_file(path);
  if (!foreign) return tl::unexpected<Error>(foreign.error());
  if (!foreign->empty()) return refusal(path, "is " + *foreign);
  auto in = FileReader::open(path);
  if (!in) return tl::unexpected<Error>(in.error());
  PlainTable table(std::move(*in), path, options);
  if (auto good = table.read_head(); !good) return tl::unexpected<Error>(good.error());
  return table;
}

std::string PlainTable::where(std::size_t line) const { return fmt::format("{}:{}", path_, line); }

/// The next line with text, without comments; false at the end.
Result<bool> PlainTable::read_line(Line& line) {
  while (in_.read_line(line.text)) {
    line.number = ++line_;
    line.ended = in_.line_ended();
    sha256_.add(line.text);
    if (line.ended) sha256_.add("\n");
    if (line_ == 1 && line.text.starts_with("\xEF\xBB\xBF")) line.text.erase(0, 3);
    if (line.text.ends_with('\r')) line.text.pop_back();
    if (std::memchr(line.text.data(), 0, line.text.size()))
      return make_error(where(line_), "found a NUL byte, expected text");
    if (std::memchr(line.text.data(), '\r', line.text.size()))
      return refusal(where(line_), "found a line end CR without LF");
    if (!line.text.starts_with("# ") && !trimmed(line.text).empty()) return true;
  }
  if (auto good = in_.finish(); !good) return tl::unexpected<Error>(good.error());
  return false;
}

/// Sets cells_, without blanks and quotes around them; valid until the next call. Returns false for a quote within a
/// cell, or one that does not end.
bool PlainTable::split(const Line& line) {
  const std::string_view text = line.text;
  const bool has_quotes = text.find('"') != std::string_view::npos;
  cells_.clear();
  unquoted_.clear();
  unquoted_.reserve(text.size());
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t first = has_quotes ? text.find_first_not_of(' ', at) : std::string_view::npos;
    if (first == std::string_view::npos || text[first] != '"') {
      const std::size_t end = separator_ == 0 ? text.size() : std::min(text.find(separator_, at), text.size());
      cells_.push_back(trimmed(text.substr(at, end - at)));
      if (has_quotes && cells_.back().find('"') != std::string_view::npos) return false;
      at = end + 1;
      continue;
    }
    const std::size_t begin = unquoted_.size();
    std::size_t end = first + 1;
    for (; end < text.size() && (text[end] != '"' || text.substr(end).starts_with("\"\"")); ++end) {
      end += text[end] == '"';
      unquoted_.push_back(text[end]);
    }
    const std::size_t next = end < text.size() ? text.find_first_not_of(' ', end + 1) : 0;
    if (next != std::string_view::npos && (next == 0 || text[next] != separator_)) return false;
    cells_.push_back(trimmed(std::string_view(unquoted_).substr(begin)));
    at = next == std::string_view::npos ? text.size() + 1 : next + 1;
  }
  return true;
}

Result<void> PlainTable::read_head() {
  Line names;
  auto more = read_line(names);
  if (!more) return tl::unexpected<Error>(more.error());
  if (!*more)
    return make_error(
        path_, line_ == 0 ? "found no row of numbers: the file is empty" : "found no row of numbers: only comments");
  separator_ = separator_of(names.text);
  if (options_.decimal == ",") {
    decimal_ = ',';
    if (separator_ == ',') return refusal(where(names.number), "found the comma as separator and as decimal sign");
  }
  latin1_ = !utf8::is_valid(names.text);
  if (latin1_) names.text = from_latin1(names.text);
  if (!split(names)) return refusal(where(names.number), "found a quote within a name, or one that does not end");
  std::vector<std::string> texts(cells_.begin(), cells_.end()), units;
  const auto number = std::ranges::find_if(cells_, [this](auto cell) { return is_number_or_time(cell); });
  if (number == cells_.end()) {
    names_line_ = names.number;
  } else if (cells_.size() == 1) {  // one column needs no name
    texts[0].clear();
    first_.push_back(std::move(names));
  } else {
    return refusal(where(names.number), fmt::format("found \"{}\", expected a line of names", shortened(*number)));
  }
  kinds_.resize(texts.size());
  if (auto good = read_first_rows(); !good) return good;
  if (units_line_ > 0) {
    split(first_[0]);
    units.assign(cells_.begin(), cells_.end());
    first_.erase(first_.begin());
  }
  if (first_.empty() || !first_[0].ended) return make_error(path_, "found no row of numbers below a line of names");
  if (auto good = name_columns(texts, units); !good) return good;
  Rows rows;
  for (const Line& line : first_) {
    if (split(line) && cells_.size() == columns_.size()) rows.emplace_back(cells_.begin(), cells_.end());
  }
  if (auto good = find_decimal(rows); !good) return good;
  find_kinds(rows);
  first_cells_ = rows.empty() ? std::vector<std::string>(columns_.size()) : rows[0];
  return {};
}

/// Reads the row of units, if there is one, and the first rows; the first of them must have a number.
Result<void> PlainTable::read_first_rows() {
  Line line;
  while (first_.size() < kFirstRows) {
    const auto more = read_line(line);
    if (!more) return tl::unexpected<Error>(more.error());
    if (!*more) break;
    first_.push_back(line);
    if (first_.size() > 1) continue;
    if (latin1_ || !utf8::is_valid(line.text)) first_[0].text = from_latin1(line.text);
    if (!split(first_[0])) return refusal(where(line.number), "found a quote within a cell, or one that does not end");
    if (cells_.size() != kinds_.size()) {
      return refusal(where(line.number), fmt::format("found {} fields, expected {} as in the names of line {}",
                                                     cells_.size(), kinds_.size(), names_line_));
    }
    const auto has_unit = [](std::string_view cell) { return read_header("x", cell).unit != nullptr; };
    const auto is_value = [](std::string_view cell) {
      return is_missing(cell) || number_in(cell, '.') || number_in(cell, ',') || iso_time(cell);
    };
    if (std::ranges::all_of(cells_, is_unit_cell) && std::ranges::any_of(cells_, has_unit))
      units_line_ = line.number;
    else if (std::ranges::none_of(cells_, is_value))
      return refusal(where(line.number), fmt::format("found \"{}\", expected numbers below the names of line {}",
                                                     shortened(cells_[0]), names_line_));
  }
  return {};
}

Result<void> PlainTable::name_columns(const std::vector<std::string>& names, const std::vector<std::string>& units) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (auto good = check_text(TextRule::kText, names[i], where(names_line_)); !good) return good;
    Header header = read_header(names[i], i < units.size() ? units[i] : "");
    const Header by_name = read_header(names[i]);
    if (by_name.unit && by_name.stated && header.unit && header.unit != by_name.unit)
      return make_error(where(names_line_),
                        fmt::format("column {}: found the unit {} in line {}, expected {} as in its "
                                    "name",
                                    names[i], header.unit->name, units_line_, by_name.unit->name));
    if (header.text.empty()) header.text = header.name = std::to_string(i + 1);
    for (const Header& other : columns_) {
      if (other.text == header.text)
        return make_error(where(names_line_), fmt::format("found column \"{}\" twice", header.text));
    }
    columns_.push_back(std::move(header));
  }
  return {};
}

/// A comma is the decimal sign if it does not separate and all numbers of the first rows say so.
Result<void> PlainTable::find_decimal(const Rows& rows) {
  if (!options_.decimal.empty() || separator_ == ',' || separator_ == 0) return {};
  std::string comma, point;  // the first of each
  for (const auto& row : rows) {
    for (const std::string& cell : row) {
      if (comma.empty() && cell.find(',') != std::string::npos && number_in(cell, ',')) comma = cell;
      if (point.empty() && cell.find('.') != std::string::npos && number_in(cell, '.')) point = cell;
    }
  }
  if (!comma.empty() && !point.empty())
    return refusal(where(first_[0].number),
                   fmt::format("found \"{}\" and \"{}\", expected one decimal sign", comma, point));
  if (!comma.empty()) decimal_ = ',';
  return {};
}

void PlainTable::find_kinds(const Rows& rows) {
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    const auto all = [&](auto is) {
      return std::ranges::all_of(rows, [&](const auto& row) { return is_missing(row[c]) || is(row[c]); });
    };
    kinds_[c] = all([this](const std::string& cell) { return number_in(cell, decimal_); }) ? ColumnKind::kNumber
                : all([](const std::string& cell) { return iso_time(cell); })              ? ColumnKind::kTime
                                                                                           : ColumnKind::kText;
  }
}

Result<std::size_t> PlainTable::find(const std::string& wanted) const {
  if (const auto by_text = first_that([&](std::size_t i) { return columns_[i].text == wanted; })) return *by_text;
  if (const auto by_name = first_that([&](std::size_t i) { return columns_[i].name == wanted; })) return *by_name;
  if (const auto at = first_that([&](std::size_t i) { return std::to_string(i + 1) == wanted; })) return *at;
  return make_error(path_, fmt::format("found no column \"{}\", expected a number from 1 to {} or one of {}", wanted,
                                       columns_.size(), names_text()));
}

std::optional<std::size_t> PlainTable::time_column() const {
  if (const auto by_unit = first_that([&](std::size_t i) {
        return columns_[i].unit && columns_[i].unit->quantity == "time" && kinds_[i] == ColumnKind::kNumber;
      }))
    return by_unit;
  if (const auto by_cells = first_that([&](std::size_t i) { return kinds_[i] == ColumnKind::kTime; })) return by_cells;
  return first_that([&](std::size_t i) { return !columns_[i].unit && may_be_time(i); });
}

bool PlainTable::may_be_time(std::size_t column) const {
  const std::string name = lower(columns_[column].name);
  constexpr std::array<std::string_view, 7> kWords = {"time", "zeit", "stamp", "x_value", "date", "datum", "week"};
  if (name == "t" || name.ends_with(".t") ||
      std::ranges::any_of(kWords, [&](std::string_view word) { return name.find(word) != std::string::npos; }))
    return true;
  const std::string& cell = first_cells_[column];
  return kinds_[column] == ColumnKind::kText && cell.size() > 3 && is_digit(cell[0]);
}

std::string PlainTable::names_text() const {
  std::string text;
  for (const Header& column : columns_) text += (text.empty() ? "" : ", ") + column.text;
  return text;
}

Result<void> PlainTable::select(Selection selection) {
  selection_ = std::move(selection);
  missing_.assign(selection_.numbers.size(), 0);
  groups_.assign(options_.decimal.empty() ? selection_.numbers.size() : 0, GroupWatch(decimal_));
  time_.reset();
  if (!selection_.time) return {};
  const Header& header = columns_[selection_.time->column];
  const std::string& cell = first_cells_[selection_.time->column];
  const std::string& stated = !selection_.time->unit.empty() ? selection_.time->unit : options_.time_unit;
  TimeFormat format{nullptr, false, selection_.time->scale, selection_.time->offset};
  if (const auto date = iso_time(cell); date && date->has_clock) {
    format.has_zone = date->has_zone;
  } else if (!number_in(cell, decimal_)) {
    return refusal(path_, fmt::format("column {}: found \"{}\", expected a time as 2024-03-01 "
                                      "12:00:05.250 or a number",
                                      header.text, shortened(cell)));
  } else {
    format.unit = !stated.empty()                                  ? find_unit("time", stated)
                  : header.unit && header.unit->quantity == "time" ? header.unit
                                                                   : nullptr;
    if (!format.unit)
      return refusal(path_,
                     fmt::format("column {}: found times as \"{}\" without a unit, expected one in its name as [s], "
                                 "or --time-unit s, ms, us, ns, min, h or d",
                                 header.text, shortened(cell)));
  }
  time_ = format;
  return {};
}

Result<std::int64_t> PlainTable::time_of(std::size_t line) const {
  const std::string& name = columns_[selection_.time->column].text;
  const std::string_view cell = cells_[selection_.time->column];
  std::optional<std::int64_t> ns;
  if (time_->is_date()) {
    const auto time = iso_time(cell);
    if (time && time->has_zone != time_->has_zone)
      return make_error(where(line), fmt::format("column {}: found \"{}\", expected {} zone as in the first row", name,
                                                 shortened(cell), time_->has_zone ? "a" : "no"));
    if (time && time->has_clock) ns = time->ns;
  } else if (const auto number = number_in(cell, decimal_)) {
    ns = time_->of_number(cell, *number);
  }
  if (!ns)
    return make_error(where(line), fmt::format("column {}: found \"{}\", expected a time ({})", name, shortened(cell),
                                               time_->text()));
  if (last_ns_ && *ns < *last_ns_)
    return make_error(where(line),
                      fmt::format("found time {} after {}, expected increasing times", time_text(*ns, time_->is_date()),
                                  time_text(*last_ns_, time_->is_date())));
  return *ns;
}

Result<bool> PlainTable::next(Row& row) {
  Line line;
  while (true) {
    if (at_ < first_.size()) {
      std::swap(line, first_[at_++]);
    } else {
      const auto more = read_line(line);
      if (!more) return tl::unexpected<Error>(more.error());
      if (!*more) break;
    }
    if (!split(line)) return make_error(where(line.number), "found a quote within a cell, or one that does not end");
    if (!line.ended && !line.text.ends_with('"')) {
      ++torn_;
      continue;
    }
    const auto has_text = [](std::string_view cell) { return !cell.empty(); };
    if (std::ranges::none_of(cells_, has_text)) continue;
    if (cells_.size() != columns_.size())
      return make_error(where(line.number),
                        fmt::format("found {} fields, expected {}", cells_.size(), columns_.size()));
    row.line = line.number;
    row.values.clear();
    bool any = false;
    for (std::size_t i = 0; i < selection_.numbers.size(); ++i) {
      const std::string_view cell = cells_[selection_.numbers[i]];
      const auto value = number_in(cell, decimal_);
      if (!value && !is_missing(cell))
        return refusal(where(line.number), fmt::format("column {}: found \"{}\", expected a number",
                                                       columns_[selection_.numbers[i]].text, shortened(cell)));
      missing_[i] += !value;
      any = any || value;
      row.values.push_back(value.value_or(kUnknown));
      if (i < groups_.size()) groups_[i].see(cell);
    }
    row.only_others = false;
    for (std::size_t c = 0; c < cells_.size() && !any && !row.only_others; ++c) {
      const bool is_time = selection_.time && selection_.time->column == c;
      row.only_others = kinds_[c] == ColumnKind::kNumber && !is_time && !is_missing(cells_[c]);
    }
    if (time_) {
      const auto time_ns = time_of(line.number);
      if (!time_ns) return tl::unexpected<Error>(time_ns.error());
      row.time_ns = *time_ns;
      last_ns_ = *time_ns;
    }
    if (selection_.keep_text) row.text = utf8::is_valid(line.text) ? line.text : from_latin1(line.text);
    ++rows_;
    return true;
  }
  if (auto good = check_groups(); !good) return tl::unexpected<Error>(good.error());
  return false;
}

// German programs write 743 and 1.006 for 743 and 1006; English ones 1,006, in which the comma is not a decimal sign.
Result<void> PlainTable::check_groups() const {
  const bool none_shown = std::ranges::none_of(groups_, [](const auto& group) { return group.is_shown(); });
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    const bool may_be_english = decimal_ == ',' && none_shown && !groups_[i].group().empty();
    if (!groups_[i].is_doubtful() && !may_be_english) continue;
    std::string digits = groups_[i].group();
    std::erase(digits, decimal_);
    return refusal(path_, fmt::format("column {}: two readings are possible: \"{}\" is {} or, with grouped digits, {}; "
                                      "state --decimal {} for the first",
                                      columns_[selection_.numbers[i]].text, groups_[i].group(),
                                      *number_in(groups_[i].group(), decimal_), digits, decimal_));
  }
  return {};
}

std::string PlainTable::form_text() const {
  std::string text = latin1_ ? "Latin-1" : "UTF-8";
  if (columns_.size() > 1)
    text += fmt::format(", separator {}", separator_ == '\t' ? "tab" : separator_ == ';' ? "semicolon" : "comma");
  text += decimal_ == ',' ? ", decimal comma" : ", decimal point";
  text += names_line_ > 0 ? fmt::format(", names in line {}", names_line_) : ", no names";
  if (units_line_ > 0) text += fmt::format(", units in line {}", units_line_);
  return text;
}

std::string PlainTable::understood() const {
  std::string text = fmt::format("{}: {}, {}", path_, form_text(), counted(columns_.size(), "column"));
  if (time_) text += fmt::format("; time {}: {}", columns_[selection_.time->column].text, time_->text());
  for (std::size_t i = 0; i < selection_.numbers.size(); ++i) {
    text += fmt::format("{}{}", i > 0 ? ", " : "; read ", columns_[selection_.numbers[i]].text);
    if (missing_[i] > 0) text += fmt::format(" ({})", counted(missing_[i], "hole"));
  }
  for (std::size_t i = 0; time_ && i < columns_.size(); ++i) {
    const Header& column = columns_[i];
    const bool is_read =
        i == selection_.time->column || std::ranges::find(selection_.numbers, i) != selection_.numbers.end();
    if (!is_read && column.stated && column.unit && column.unit->quantity == "time" && kinds_[i] == ColumnKind::kNumber)
      text += fmt::format("; not read: {}, a second time", column.text);
  }
  text += "; " + counted(rows_, "row");
  if (torn_ > 0) text += ", 1 last row without a line end left out";
  return text;
}

}  // namespace prism::tables
