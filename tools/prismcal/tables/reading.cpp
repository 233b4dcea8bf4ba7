// SPDX-License-Identifier: MIT
#include "tools/prismcal/tables/reading.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "base/escape.hpp"
#include "tools/prismcal/tables/cell.hpp"
#include "tools/prismcal/tables/date_text.hpp"
#include "tools/prismcal/tables/header_unit.hpp"
#include "tools/prismcal/tables/row_splitter.hpp"

namespace prism::tables {
namespace {

bool is_number_or_time(const std::string& cell, char decimal) { return number_in(cell, decimal) || date_in(cell); }

bool is_value(const std::string& cell, char decimal) { return is_hole(cell) || is_number_or_time(cell, decimal); }

bool has_unit(const SampleRow& row) {
  return std::any_of(row.cells.begin(), row.cells.end(),
                     [](const std::string& cell) { return read_header("x", cell).unit; });
}

bool all_empty(const std::vector<std::string>& cells) {
  return std::all_of(cells.begin(), cells.end(), [](const std::string& cell) { return cell.empty(); });
}

}  // namespace

std::vector<SampleRow> split_sample(const std::vector<SampleLine>& lines, char separator) {
  constexpr std::size_t kMaxOpenLines = 20;
  std::vector<SampleRow> rows;
  RowSplitter splitter(separator);
  std::size_t begun = 0, open = 0;
  for (const SampleLine& line : lines) {
    if (!splitter.is_open()) begun = line.number, open = 0;
    if (splitter.is_open() && ++open > kMaxOpenLines) break;
    if (!splitter.push(line.text)) continue;
    SampleRow row{begun, splitter.cells(), !line.ended && !splitter.last_is_quoted()};
    if (!all_empty(row.cells)) rows.push_back(std::move(row));
  }
  return rows;
}

Reading::Reading(std::vector<SampleRow> rows, char separator, char decimal, const std::vector<SampleLine>& comments,
                 std::optional<int> header_row)
    : rows_(std::move(rows)), separator_(separator), decimal_(decimal) {
  find_width();
  find_values();
  find_start(header_row);
  if (!good()) return;
  find_names(comments, header_row);
  drop_trailing();
}

void Reading::find_width() {
  std::map<std::size_t, std::size_t> counts;
  for (const SampleRow& row : rows_) ++counts[row.cells.size()];
  std::size_t most = 0;
  for (const auto& [width, count] : counts) {
    // Where few rows decide, the later ones are data.
    if (count >= most) width_ = width, most = count;
  }
  if (rows_.size() < 4 && !rows_.empty()) {
    const SampleRow& last = rows_.size() > 1 && rows_.back().torn ? rows_[rows_.size() - 2] : rows_.back();
    width_ = last.cells.size();
  }
}

void Reading::find_values() {
  values_.assign(width_, false);
  std::vector<const SampleRow*> data;
  for (const SampleRow& row : rows_) {
    if (row.cells.size() == width_ && !row.torn) data.push_back(&row);
  }
  if (data.empty() && !rows_.empty()) data.push_back(&rows_.back());
  // Names and units: in a short table they are too many to be left to the 9 of 10 below.
  const auto first = std::find_if(data.begin(), data.end(), [this](const SampleRow* row) {
    return std::any_of(row->cells.begin(), row->cells.end(),
                       [this](const std::string& cell) { return is_number_or_time(cell, decimal_); });
  });
  const bool titled = first != data.begin() && first != data.end();
  if (titled) data.erase(data.begin(), first);
  if (data.size() >= 8)
    data.erase(data.begin(), data.begin() + static_cast<std::ptrdiff_t>(data.size() / 2));
  else if (data.size() > 1 && !titled)
    data.erase(data.begin());
  if (data.empty() || data.front()->cells.size() != width_) return;
  std::size_t columns = 0, holes = 0;
  for (std::size_t c = 0; c < width_; ++c) {
    std::size_t known = 0, empty = 0;
    for (const SampleRow* row : data) {
      empty += is_hole(row->cells[c]);
      known += is_number_or_time(row->cells[c], decimal_);
    }
    values_[c] = known > 0 && 10 * (known + empty) >= 9 * data.size();
    columns += values_[c];
    holes += empty == data.size();
  }
  if (columns == 0) return;
  share_ = static_cast<double>(columns + holes) / static_cast<double>(width_);
  clean_ = columns + holes == width_;
}

bool Reading::has_number(const SampleRow& row) const {
  if (row.cells.size() != width_) return false;
  for (std::size_t c = 0; c < width_; ++c) {
    if (values_[c] && is_number_or_time(row.cells[c], decimal_)) return true;
  }
  return false;
}

bool Reading::is_data(const SampleRow& row) const {
  if (!has_number(row)) return false;
  for (std::size_t c = 0; c < width_; ++c) {
    if (values_[c] && !is_value(row.cells[c], decimal_)) return false;
  }
  return true;
}

bool Reading::is_damaged_data(const SampleRow& row) const {
  if (!has_number(row)) return false;
  std::size_t columns = 0, readable = 0;
  for (std::size_t c = 0; c < width_; ++c) {
    columns += values_[c];
    readable += values_[c] && is_value(row.cells[c], decimal_);
  }
  return 2 * readable > columns;
}

void Reading::find_start(std::optional<int> header_row) {
  start_ = rows_.size();
  if (share_ == 0) return;
  const auto after_names = [&](const SampleRow& row) {
    return !header_row || row.number > static_cast<std::size_t>(std::max(0, *header_row));
  };
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (!after_names(rows_[i])) continue;
    if (header_row || (is_data(rows_[i]) &&
                       (i + 1 >= rows_.size() || rows_[i + 1].cells.size() != width_ || has_number(rows_[i + 1])))) {
      if (header_row && !has_number(rows_[i])) continue;  // the row of units
      start_ = i;
      break;
    }
  }
  // A damaged row above the others is data, too: the parser names its bad cell. Not so a title with a date.
  while (!header_row && start_ < rows_.size() && start_ > 0 && is_damaged_data(rows_[start_ - 1])) --start_;
}

void Reading::find_names(const std::vector<SampleLine>& comments, std::optional<int> header_row) {
  if (header_row && *header_row == 0) return;
  const auto same_width = [&](const SampleRow& row) {
    return row.cells.size() == width_ ||
           (row.cells.size() == width_ + 1 && (row.cells.back().empty() || row.cells.back() == "Comment"));
  };
  const auto is_units = [&](const SampleRow& row) {
    return same_width(row) && std::all_of(row.cells.begin(), row.cells.end(), is_unit_cell) &&
           std::any_of(row.cells.begin(), row.cells.end(), [](const std::string& cell) { return !cell.empty(); });
  };
  std::size_t names = start_;
  if (start_ > 0 && is_units(rows_[start_ - 1]) && start_ > 1 && same_width(rows_[start_ - 2])) {
    units_line_ = rows_[start_ - 1].number;
    units_ = rows_[start_ - 1].cells;
    names = start_ - 1;
  } else if (start_ > 2 && same_width(rows_[start_ - 1]) && !has_number(rows_[start_ - 1]) &&
             is_units(rows_[start_ - 2]) && has_unit(rows_[start_ - 2]) && same_width(rows_[start_ - 3])) {
    // Campbell's loggers and Origin write a third line: Avg, Smp, or comments.
    units_line_ = rows_[start_ - 2].number;
    units_ = rows_[start_ - 2].cells;
    names = start_ - 2;
  }
  if (header_row) {
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (rows_[i].number == static_cast<std::size_t>(*header_row)) names = i + 1;
    }
  }
  const std::size_t first_line = rows_[start_].number;
  if (names > 0 && same_width(rows_[names - 1]) && (header_row || !has_number(rows_[names - 1]))) {
    names_line_ = rows_[names - 1].number;
    names_ = rows_[names - 1].cells;
  } else if (!comments.empty()) {
    // numpy.savetxt() and rostopic write the names as a comment.
    for (auto line = comments.rbegin(); line != comments.rend(); ++line) {
      if (line->number > first_line) continue;
      const std::size_t begin = line->text.find_first_not_of("#%/ ");
      const auto split =
          split_sample({{line->number, begin == std::string::npos ? "" : line->text.substr(begin)}}, separator_);
      if (!split.empty() && split[0].cells.size() == width_ && (width_ > 1 || line->number + 1 == first_line)) {
        names_line_ = line->number;
        names_ = split[0].cells;
      }
      break;
    }
  }
  if (names_line_ == 0 && names > 0) {
    const SampleRow& row = rows_[names - 1];
    const bool text = std::none_of(row.cells.begin(), row.cells.end(),
                                   [&](const std::string& cell) { return is_number_or_time(cell, decimal_); });
    if (row.cells.size() > 1 && text) other_width_ = row.cells.size(), other_line_ = row.number;
    if (width_ == 1 + row.cells.size() && text) {
      names_line_ = row.number;
      names_ = row.cells;
    }
  }
}

void Reading::drop_trailing() {
  if (width_ < 2 || (names_.size() >= width_ && !names_[width_ - 1].empty())) {
    if (names_.size() == width_ - 1) names_line_ = 0;
    return;
  }
  for (std::size_t i = start_; i < rows_.size(); ++i) {
    if (rows_[i].cells.size() == width_ && !rows_[i].cells.back().empty()) {
      if (names_.size() + 1 == width_) names_line_ = 0;
      return;
    }
  }
  if (names_line_ == 0) return;
  trailing_ = true;
  other_line_ = 0;
}

bool Reading::names_line_has(char separator) const { return separator != 0 && names_line_ > 0 && names_.size() > 1; }

std::vector<std::vector<std::string>> Reading::data() const {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = start_; i < rows_.size(); ++i) {
    if (rows_[i].cells.size() == width_ && !rows_[i].torn) rows.push_back(rows_[i].cells);
  }
  return rows;
}

bool Reading::differs_from(const Reading& other) const {
  if (width() != other.width()) return true;
  for (std::size_t i = start_; i < rows_.size() && i < start_ + 50; ++i) {
    for (std::size_t c = 0; c < rows_[i].cells.size() && c < width(); ++c) {
      if (i >= other.rows_.size() || other.rows_[i].cells.size() <= c) return true;
      const auto mine = number_in(rows_[i].cells[c], decimal_),
                 theirs = number_in(other.rows_[i].cells[c], other.decimal_);
      if (mine.has_value() != theirs.has_value() || (mine && *mine != *theirs)) return true;
    }
  }
  return false;
}

bool Reading::only_groups() const {
  bool any = false;
  for (std::size_t i = start_; i < rows_.size(); ++i) {
    for (std::size_t c = 0; c < rows_[i].cells.size() && c < values_.size(); ++c) {
      const std::string& cell = rows_[i].cells[c];
      if (!values_[c] || cell.find(',') == std::string::npos || !number_in(cell, ',')) continue;
      if (!may_be_grouped(cell)) return false;
      any = true;
    }
  }
  return any;
}

std::string Reading::first_row_text() const {
  std::string text;
  for (std::size_t c = 0; c < first().cells.size() && c < 6; ++c) {
    const std::string& cell = first().cells[c];
    const auto number = number_in(cell, decimal_);
    text += fmt::format("{}{}", c > 0 ? " | " : "", number ? fmt::format("{}", *number) : shortened(cell, 24));
  }
  return fmt::format("\"{}\" ({}{})", text, first().cells.size() > 1 ? "cells separated by | here" : "one cell",
                     decimal_ == ',' ? ", decimal comma" : ", decimal point");
}

std::string Reading::first_row_text_of_groups() const {
  std::string text;
  for (std::size_t c = 0; c < first().cells.size() && c < 6; ++c) {
    std::string cell = first().cells[c];
    if (may_be_grouped(cell)) cell.erase(std::remove(cell.begin(), cell.end(), ','), cell.end());
    text += fmt::format("{}{}", c > 0 ? " | " : "", shortened(cell, 24));
  }
  return fmt::format("\"{}\" (grouped digits)", text);
}

Result<void> Reading::check_names(const std::string& path) const {
  if (other_line_ == 0 || names_line_ > 0) return {};
  const bool commas = separator_ == ',' && width_ + (other_width_ > 2) >= 2 * other_width_;
  return make_error(
      fmt::format("{}:{}", path, first().number),
      fmt::format("found {} fields, expected {} as in the names of line {}{}", width_, other_width_, other_line_,
                  commas ? "; commas as decimal signs, too? Then export with another separator" : ""));
}

std::string no_numbers_text(const std::vector<SampleLine>& lines, const std::vector<SampleLine>& comments) {
  if (lines.empty() && comments.empty()) return "found no row of numbers: the file is empty";
  if (lines.empty()) return "found no row of numbers: only comments";
  return "found no row of numbers below a line of names";
}

}  // namespace prism::tables
