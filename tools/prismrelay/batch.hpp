// SPDX-License-Identifier: MIT
// The data of one transaction: rows of any gyros, cursors, gaps, invalid lines and events.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "tools/prismrelay/row_converter.hpp"

namespace prism::prismrelay {

/// Identifies the log of one axis.
struct LogKey {
  std::string gyro;  ///< SITE/NAME
  std::string axis;

  auto operator<=>(const LogKey&) const = default;
};

/// Result of add_page().
struct PageSummary {
  std::string cursor;         ///< after its last row
  std::size_t rows = 0;       ///< valid rows
  std::size_t invalid = 0;    ///< lines that are not valid rows
  std::string error = {};     ///< of the last invalid line
  std::uint64_t missing = 0;  ///< rows deleted before the request
  double arrival_s = 0;       ///< of the last valid row; 0 without one
  bool more = false;          ///< the log has further rows
};

/// The tables that a batch fills.
enum class Table : std::uint8_t { kRows, kSegments, kPlaces, kGaps, kRefused, kEvents };
inline constexpr std::size_t kTables = 6;

/// CSV lines for COPY, by table.
using CopyTexts = std::array<std::string, kTables>;

/// One line for COPY. The texts are in its item.
struct Record {
  Table table = Table::kRows;
  std::size_t csv = 0, csv_bytes = 0;    ///< position in BatchItem::csv
  std::size_t line = 0, line_bytes = 0;  ///< position in BatchItem::lines: a row of kRows as in the log
  std::uint64_t segment = 0, row = 0;    ///< of kRows; kSegments has a segment
  double arrival_s = 0;                  ///< of kRows
  std::int64_t day = 0;                  ///< of the arrival, since 1970 UTC
};

/// A page of a log, the change of a log, or an event. Its records and its cursor are stored together.
struct BatchItem {
  LogKey log;          ///< of an event: without the axis
  std::string key;     ///< gyro and axis as CSV fields
  std::string log_id;  ///< of a page
  std::string cursor;  ///< after the last row of the page; empty: not a page
  std::string csv, lines;
  std::vector<Record> records;

  std::string_view csv_of(const Record& record) const {
    return std::string_view(csv).substr(record.csv, record.csv_bytes);
  }
  std::string_view line_of(const Record& record) const {
    return std::string_view(lines).substr(record.line, record.line_bytes);
  }
  /// Adds a line for COPY with the text that was appended to `csv` since `begin`.
  Record& add(Table table, std::size_t begin);
};

/// Appends the line of kPlaces of a page: its cursor, the number of `rows` (records of kRows) and the last of them.
void append_place(CopyTexts& texts, const BatchItem& item, const std::vector<const Record*>& rows);
/// Appends the line of kRefused for a row or segment that the server refused because of `reason`.
void append_refused(CopyTexts& texts, const BatchItem& item, const Record& record, const std::string& reason);

class Batch {
 public:
  /// Adds the result of prismd's method `rows` after `cursor`. At most one page of each log per batch. Errors: the
  /// result has an unexpected form; the batch is then unchanged.
  Result<PageSummary> add_page(const LogKey& log, const std::string& cursor, const nlohmann::json& page);
  /// Records that the log of `cursor` no longer exists and a new one starts.
  void add_change_of_log(const LogKey& log, const std::string& cursor);
  /// Adds an event of prismd, {time_s, severity, kind, text}. Ignores one without a valid time.
  void add_event(const std::string& gyro, const nlohmann::json& event);

  bool empty() const { return items_.empty(); }
  std::size_t bytes() const { return bytes_; }  ///< of the lines for COPY, about
  const std::vector<BatchItem>& items() const { return items_; }
  /// All lines of the items from `first` to before `last`.
  CopyTexts texts(std::size_t first, std::size_t last) const;
  std::string text(Table table) const { return texts(0, items_.size())[static_cast<std::size_t>(table)]; }
  /// Days of arrival of the rows, since 1970 UTC.
  std::set<std::int64_t> days() const;

 private:
  static void add_segment(BatchItem& item, const nlohmann::json& segment, PageSummary& summary);

  std::vector<BatchItem> items_;
  std::size_t bytes_ = 0;
};

}  // namespace prism::prismrelay
