// SPDX-License-Identifier: MIT
// A table of text: cells of the selected columns become numbers and times, block by block.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "compensation/sample.hpp"
#include "tools/prismcal/tables/cell.hpp"
#include "tools/prismcal/tables/row_splitter.hpp"
#include "tools/prismcal/tables/table_source.hpp"
#include "tools/prismcal/tables/text_lines.hpp"

namespace prism::tables {
namespace {

class TextTable : public TableSource {
 public:
  TextTable(const std::string& path, Dialect dialect, TextLines lines, TableOptions options)
      : TableSource(path),
        dialect_(std::move(dialect)),
        lines_(std::move(lines)),
        splitter_(dialect_.separator),
        options_(std::move(options)) {
    columns_ = dialect_.columns;
    meter_ = ReadMeter(options_.progress, lines_.size_bytes());
  }

  Result<void> select(Selection selection) override;
  Result<bool> next(Block& block) override;
  char separator() const override { return dialect_.separator == 0 ? ',' : dialect_.separator; }
  char decimal() const override { return dialect_.decimal; }
  std::string dialect_text() const override { return dialect_.text(); }
  ColumnKind kind(std::size_t column) const override;
  bool may_be_time(std::size_t column) const override;

 private:
  Result<bool> next_row();
  Result<void> add_row(Block& block);
  Result<void> check_groups() const;
  std::string where() const { return fmt::format("{}:{}", path_, row_line_); }

  Dialect dialect_;
  TextLines lines_;
  RowSplitter splitter_;
  TableOptions options_;
  ReadMeter meter_;
  std::size_t row_line_ = 0;
  std::string row_text_;
  std::vector<GroupWatch> groups_;                ///< per selected column, without --decimal
  std::int64_t last_clock_ns_ = 0, days_ns_ = 0;  ///< a time of day without a date goes on after midnight
};

ColumnKind TextTable::kind(std::size_t column) const {
  std::size_t numbers = 0, holes = 0, times = 0;
  for (const auto& row : dialect_.sample) {
    numbers += number_in(row[column], dialect_.decimal).has_value();
    holes += is_hole(row[column]);
    times += date_in(row[column]).has_value();
  }
  if (numbers + holes == dialect_.sample.size()) return ColumnKind::kNumber;
  return times + holes == dialect_.sample.size() ? ColumnKind::kTime : ColumnKind::kText;
}

bool TextTable::may_be_time(std::size_t column) const {
  if (is_named_time(column)) return true;
  if (kind(column) != ColumnKind::kText || dialect_.sample.empty()) return false;
  const std::string& cell = dialect_.sample.front()[column];
  return cell.size() > 3 && cell[0] >= '0' && cell[0] <= '9';
}

Result<void> TextTable::select(Selection selection) {
  selection_ = std::move(selection);
  counts_ = {};
  counts_.holes.assign(selection_.numbers.size(), 0);
  groups_.assign(options_.decimal.empty() ? selection_.numbers.size() : 0, GroupWatch(dialect_.decimal));
  if (!selection_.time) return {};
  auto format = detect_time(path_, columns_, dialect_.sample, selection_.time->column, selection_.time->unit,
                            dialect_.decimal, options_);
  if (!format) return tl::unexpected<Error>(format.error());
  time_ = std::move(*format);
  time_->scale = selection_.time->scale;
  time_->offset = selection_.time->offset;
  return {};
}

// Reads lines until a row is complete. Returns false at the end.
Result<bool> TextTable::next_row() {
  while (lines_.next()) {
    if (lines_.number() < dialect_.first_line) continue;
    if (!splitter_.is_open()) {
      if (is_comment(lines_.line())) continue;
      row_line_ = lines_.number();
      if (selection_.keep_text) row_text_.clear();
    }
    if (selection_.keep_text) row_text_.append(row_text_.empty() ? "" : "\n").append(lines_.line());
    const bool complete = splitter_.push(lines_.line());
    if (splitter_.is_open() && splitter_.open_bytes() > kMaxLineBytes)
      return make_error(where(), "found a quote that never ends");
    if (!complete) continue;
    if (!lines_.ended() && !splitter_.last_is_quoted()) {
      ++counts_.torn;
      continue;
    }
    bool empty = true;
    for (std::size_t i = 0; empty && i < splitter_.size(); ++i) empty = splitter_.cell(i).empty();
    if (!empty) return true;
  }
  if (auto good = lines_.finish(); !good) return tl::unexpected<Error>(good.error());
  if (splitter_.is_open()) return make_error(where(), "found a quote that never ends");
  return false;
}

Result<void> TextTable::add_row(Block& block) {
  const std::size_t expected = dialect_.width + (dialect_.trailing ? 1 : 0);
  if (splitter_.size() != expected)
    return make_error(where(), fmt::format("found {} fields, expected {}", splitter_.size(), expected));
  if (dialect_.trailing && !splitter_.cell(expected - 1).empty())
    return make_error(where(), fmt::format("found {} fields, expected {}", expected, expected - 1));
  for (std::size_t i = 0; i < selection_.numbers.size(); ++i) {
    const std::string_view cell = splitter_.cell(selection_.numbers[i]);
    auto value = number_in(cell, dialect_.decimal);
    if (!value && is_hole(cell)) {
      value = kUnknown;
      ++counts_.holes[i];
    }
    if (!value)
      return make_error(where(), fmt::format("column {}: found \"{}\", expected a number",
                                             columns_[selection_.numbers[i]].text, shortened(cell)));
    if (i < groups_.size()) groups_[i].see(cell);
    block.columns[i].push_back(*value);
  }
  if (time_) {
    const std::string_view cell = splitter_.cell(selection_.time->column);
    auto ns = time_->parse(cell, time_->second ? splitter_.cell(*time_->second) : std::string_view());
    if (!ns)
      return make_error(where(), fmt::format("column {}: found \"{}\", expected a time ({})",
                                             columns_[selection_.time->column].text, shortened(cell), time_->text));
    if (time_->kind == TimeKind::kText && !time_->has_date) {
      constexpr std::int64_t kHalfDay_ns = 12LL * 3600 * 1'000'000'000;
      if (*ns < last_clock_ns_ - kHalfDay_ns) days_ns_ += 2 * kHalfDay_ns;
      last_clock_ns_ = *ns;
      *ns += days_ns_;
    }
    block.time_ns.push_back(*ns);
  }
  block.lines.push_back(row_line_);
  if (selection_.keep_text) block.text.push_back(row_text_);
  ++block.rows;
  ++counts_.rows;
  return {};
}

// German programs write 743 and 1.006 for 743 and 1006.
Result<void> TextTable::check_groups() const {
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    if (!groups_[i].is_doubtful()) continue;
    std::string digits = groups_[i].group();
    std::erase(digits, dialect_.decimal);
    return make_error(path_,
                      fmt::format("column {}: two readings are possible: \"{}\" is {} or, with grouped digits, {}; "
                                  "state --decimal , or --decimal .",
                                  columns_[selection_.numbers[i]].text, groups_[i].group(),
                                  *number_in(groups_[i].group(), dialect_.decimal), digits));
  }
  return {};
}

Result<bool> TextTable::next(Block& block) {
  block.rows = 0;
  block.columns.resize(selection_.numbers.size());
  for (auto& column : block.columns) column.clear();
  block.time_ns.clear();
  block.lines.clear();
  block.text.clear();
  meter_.set(lines_.bytes_read(), counts_.rows);
  while (block.rows < kBlockRows) {
    const auto more = next_row();
    if (!more) return tl::unexpected<Error>(more.error());
    if (!*more) {
      if (auto good = check_groups(); !good) return tl::unexpected<Error>(good.error());
      break;
    }
    if (auto added = add_row(block); !added) return tl::unexpected<Error>(added.error());
  }
  return block.rows > 0;
}

}  // namespace

Result<std::unique_ptr<TableSource>> open_text_table(const std::string& path, const TableOptions& options) {
  auto dialect = detect_dialect(path, options);
  if (!dialect) return tl::unexpected<Error>(dialect.error());
  auto lines = TextLines::open(path, dialect->encoding);
  if (!lines) return tl::unexpected<Error>(lines.error());
  return std::unique_ptr<TableSource>(
      std::make_unique<TextTable>(path, std::move(*dialect), std::move(*lines), options));
}

}  // namespace prism::tables
