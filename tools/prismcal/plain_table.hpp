// SPDX-License-Identifier: MIT
// A plain table, read once, row by row, in constant memory: docs/your-files.md states its form. prism-import makes one
// of any other table.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/file.hpp"
#include "base/sha256.hpp"
#include "tools/prismcal/units.hpp"

namespace prism::tables {

/// Statements of the user about a table.
struct TableOptions {
  std::string decimal;    ///< "." or ","; empty: as the cells say
  std::string time_unit;  ///< s, ms, us, ns, min, h or d of a time that is a number; empty: by the header
  double interval_s = 0;  ///< > 0: true spacing of the rows
  /// Called once per file that was read, with one line of how it was understood. May be empty.
  std::function<void(const std::string&)> announce;

  void silence() { announce = {}; }  ///< --quiet
};

/// The number of a cell with this decimal sign; nullopt for any other text.
std::optional<double> number_in(std::string_view cell, char decimal);

/// The short integers of a column, "743", and numbers such as "1.006", which may be 1006 with grouped digits. Any other
/// number shows that it is not; and "25.001" next to 25 is a decimal.
class GroupWatch {
 public:
  explicit GroupWatch(char decimal) : decimal_(decimal) {}
  void see(std::string_view cell);
  bool is_doubtful() const { return !shown_ && !group_.empty() && least_group_ < 10 * largest_integer_; }
  bool is_shown() const { return shown_; }             ///< by a number of another form
  const std::string& group() const { return group_; }  ///< the first one

 private:
  char decimal_;
  bool shown_ = false;
  int largest_integer_ = 0, least_group_ = 1'000'000;
  std::string group_;
};

/// The time column to read, with its unit and conversion from --map.
struct TimeSelection {
  std::size_t column = 0;
  std::string unit = {};  ///< empty: by TableOptions, else by the header
  double scale = 1, offset = 0;
};

struct Selection {
  std::vector<std::size_t> numbers;  ///< columns, from 0
  std::optional<TimeSelection> time;
  bool keep_text = false;  ///< Row::text
};

struct Row {
  std::size_t line = 0;        ///< from 1
  std::int64_t time_ns = 0;    ///< 0 without a time
  std::vector<double> values;  ///< of Selection::numbers, as in the file; missing: kUnknown
  bool only_others = false;    ///< all of them are missing, and another column of numbers has a value
  std::string text;            ///< as in the file, as UTF-8
};

/// Type of all cells of a column in the first rows.
enum class ColumnKind { kNumber, kTime, kText };

/// The kind of a file of another program, by its first bytes: "an Excel file (.xlsx)", "UTF-16 text", …; empty: none of
/// those that are not plain tables. Errors: those of FileReader::open().
Result<std::string> foreign_file(const std::string& path);

class PlainTable {
 public:
  /// Reads the names, the units and the first rows. Errors: those of FileReader; a file that is not a plain table.
  static Result<PlainTable> open(const std::string& path, const TableOptions& options);

  const std::string& path() const { return path_; }
  const std::vector<Header>& columns() const { return columns_; }
  ColumnKind kind(std::size_t column) const { return kinds_[column]; }
  /// The first column for whose number `is` returns true.
  template <class Is>
  std::optional<std::size_t> first_that(const Is& is) const {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (is(i)) return i;
    }
    return std::nullopt;
  }
  /// A column by its header, by its header without the unit, or by its number from 1. Errors: unknown.
  Result<std::size_t> find(const std::string& wanted) const;
  std::string names_text() const;  ///< all headers, separated by commas
  /// The column that is most likely the time: by its unit, its cells, its name; it may be one that prismcal cannot
  /// read. nullopt: none.
  std::optional<std::size_t> time_column() const;

  /// Call before next(). Errors: the column has no time, or a number without a unit.
  Result<void> select(Selection selection);
  /// The next row; false at the end. Errors, with file and line: a row of another width, a cell that is neither a
  /// number nor missing, a row without a time, or one before the row above it.
  Result<bool> next(Row& row);

  const TimeFormat* time() const { return time_ ? &*time_ : nullptr; }
  bool has_dates() const { return time_ && time_->is_date(); }
  char separator() const { return separator_ == 0 ? ',' : separator_; }
  char decimal() const { return decimal_; }
  std::size_t rows() const { return rows_; }
  std::size_t torn() const { return torn_; }  ///< last row without a line end, left out
  std::size_t missing(std::size_t selected) const { return missing_[selected]; }
  /// "UTF-8, separator semicolon, decimal comma, names in line 1".
  std::string form_text() const;
  /// One line of how the table was understood, complete after the last row.
  std::string understood() const;
  std::string sha256() const { return sha256_.hex(); }  ///< of the bytes that were read

 private:
  struct Line {
    std::size_t number = 0;
    std::string text;
    bool ended = true;
  };
  using Rows = std::vector<std::vector<std::string>>;
  PlainTable(FileReader in, const std::string& path, const TableOptions& options)
      : in_(std::move(in)), path_(path), options_(options) {}
  Result<bool> read_line(Line& line);
  Result<void> read_head();
  Result<void> read_first_rows();
  Result<void> name_columns(const std::vector<std::string>& names, const std::vector<std::string>& units);
  Result<void> find_decimal(const Rows& rows);
  void find_kinds(const Rows& rows);
  Result<void> check_groups() const;
  Result<std::int64_t> time_of(std::size_t line) const;
  bool may_be_time(std::size_t column) const;
  bool split(const Line& line);
  std::string where(std::size_t line) const;
  bool is_number_or_time(std::string_view cell) const { return number_in(cell, decimal_) || iso_time(cell); }

  FileReader in_;
  std::string path_;
  TableOptions options_;
  Sha256 sha256_;
  std::size_t line_ = 0;  ///< last line that was read
  char separator_ = 0;    ///< 0: one column
  char decimal_ = '.';
  bool latin1_ = false;  ///< the names are not UTF-8
  std::size_t names_line_ = 0, units_line_ = 0;
  std::vector<Header> columns_;
  std::vector<ColumnKind> kinds_;
  std::vector<Line> first_;  ///< the first rows
  std::size_t at_ = 0;       ///< of first_, from there not yet returned
  std::vector<std::string> first_cells_;
  std::vector<std::string_view> cells_;
  std::string unquoted_;
  Selection selection_;
  std::optional<TimeFormat> time_;
  std::optional<std::int64_t> last_ns_;
  std::vector<GroupWatch> groups_;  ///< per selected column, without --decimal
  std::size_t rows_ = 0, torn_ = 0;
  std::vector<std::size_t> missing_;
};

}  // namespace prism::tables
