// SPDX-License-Identifier: MIT
// A table of any origin as blocks of typed columns, in memory that does not depend on its length.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismcal/tables/dialect.hpp"
#include "tools/prismcal/tables/table_options.hpp"
#include "tools/prismcal/tables/time_format.hpp"

namespace prism::tables {

/// The time column to read, if any, with its unit and conversion from --map.
struct TimeSelection {
  std::size_t column = 0;
  std::string unit;  ///< empty: by the header or detected
  double scale = 1, offset = 0;
};

struct Selection {
  std::vector<std::size_t> numbers;  ///< columns, from 0
  std::optional<TimeSelection> time;
  bool keep_text = false;  ///< Block::text
};

struct Block {
  std::size_t rows = 0;
  std::vector<std::vector<double>> columns;  ///< in the order of Selection::numbers, as in the file; a hole is kUnknown
  std::vector<std::int64_t> time_ns;         ///< empty without a time
  std::vector<std::size_t> lines;            ///< line (.csv) or row (.mat), from 1
  std::vector<std::string> text;             ///< the row as in the file, as UTF-8
};

struct TableCounts {
  std::size_t rows = 0;
  std::size_t torn = 0;            ///< last rows without a line end, left out
  std::vector<std::size_t> holes;  ///< per selected column
};

/// Type of most cells of a column.
enum class ColumnKind { kNumber, kTime, kText };

class TableSource {
 public:
  static constexpr std::size_t kBlockRows = 4096;

  explicit TableSource(std::string path) : path_(std::move(path)) {}
  virtual ~TableSource() = default;
  TableSource(const TableSource&) = delete;
  TableSource& operator=(const TableSource&) = delete;

  const std::string& path() const { return path_; }
  const std::vector<Header>& columns() const { return columns_; }
  /// A column by its header, by its header without the unit, or by its number from 1. Errors: unknown.
  Result<std::size_t> find(const std::string& wanted) const;
  std::string names_text() const;  ///< all headers, separated by commas
  virtual ColumnKind kind(std::size_t column) const = 0;
  /// The column that is most likely the time: by its unit, its cells, its name. nullopt: none.
  std::optional<std::size_t> time_column() const;

  /// True if the name is that of a time, or if the cells are texts that begin with a digit.
  virtual bool may_be_time(std::size_t column) const { return is_named_time(column); }

  /// Call once before next(). Errors: those of detect_time().
  virtual Result<void> select(Selection selection) = 0;
  /// Fills the block with the next rows, at most kBlockRows. Returns false at the end, with an empty block. Errors,
  /// with file and line: a row of another width, a cell that is neither a number nor a hole, a row without a time.
  virtual Result<bool> next(Block& block) = 0;
  virtual char separator() const { return ','; }
  virtual char decimal() const { return '.'; }
  /// "UTF-8, separator semicolon, decimal comma, names in line 1".
  virtual std::string dialect_text() const = 0;

  const TableCounts& counts() const { return counts_; }
  const TimeFormat* time() const { return time_ ? &*time_ : nullptr; }
  /// One line of how the table was understood, complete after the last block.
  std::string understood() const;

 protected:
  bool is_named_time(std::size_t column) const;

  std::string path_;
  std::vector<Header> columns_;
  Selection selection_;
  std::optional<TimeFormat> time_;
  TableCounts counts_;
};

/// Opens a table by its first bytes: text, or MATLAB's .mat. Errors: those of detect_dialect(); a file of another
/// program, with the way to export it.
Result<std::unique_ptr<TableSource>> open_table(const std::string& path, const TableOptions& options);

/// Text tables.
Result<std::unique_ptr<TableSource>> open_text_table(const std::string& path, const TableOptions& options);

}  // namespace prism::tables
