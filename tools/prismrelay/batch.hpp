// SPDX-License-Identifier: MIT
// Pages of logs and events, converted to lines of COPY.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace prism::prismrelay {

/// Identifies the log of one axis.
struct LogKey {
  std::string gyro;  ///< SITE/NAME
  std::string axis;

  auto operator<=>(const LogKey&) const = default;
};

/// The tables that a batch fills, in the order in which they are filled.
enum Table : std::size_t { kSegments, kRows, kGaps, kEvents, kRefused, kPlaces, kTables };

/// Lines of COPY, by table: CSV; of kRows records in its binary format, which the server reads 1.4 times as fast.
using Texts = std::array<std::string, kTables>;

/// A line of COPY.
struct Record {
  std::uint64_t segment = 0, row = 0;  ///< of kRows; kSegments has a segment
  std::string_view line = {};          ///< of kRows: as in the log; of kSegments: the file
  std::int64_t arrival_ns = 0;         ///< of kRows
  std::size_t end = 0;                 ///< position in the text of its table
  bool is_refused = false;             ///< the server refused it; set by the commit
};

/// A page of a log, the change of a log, or an event. Its records and its cursor are stored together.
struct BatchItem {
  LogKey log;                  ///< of an event: without the axis
  std::string log_id;          ///< of a page
  std::string cursor;          ///< after the last row of the page; empty: not a page
  bool more = false;           ///< the log has further rows
  std::uint64_t missing = 0;   ///< rows deleted before the request
  std::size_t invalid = 0;     ///< lines that are not rows
  std::string error = {};      ///< of the last such line
  nlohmann::json source = {};  ///< the response of prismd, to which the lines refer
  Texts texts = {};
  std::array<std::vector<Record>, kTables> records = {};  ///< of each line of `texts`
  std::set<std::int64_t> days = {};                       ///< of the arrival of the rows, since 1970 UTC

  // Set by the commit.
  std::string refusal = {};       ///< the first refused record and its reason; empty: all are stored
  std::string cursor_error = {};  ///< reason why the item is not stored
  bool is_done = false;           ///< the commit ended, also with an error
  bool is_stored = false;         ///< without an error

  /// The server refused a record.
  void refuse(Table table, Record& record, const std::string& reason);
  /// No rows and no gap.
  bool is_empty() const {
    return std::all_of(texts.begin(), texts.end(), [](const auto& text) { return text.empty(); });
  }
};

/// At most one page of each log.
using Batch = std::vector<std::shared_ptr<BatchItem>>;

/// The result of prismd's method `rows` after `cursor`, for one axis. Errors: the result has an unexpected form.
Result<std::shared_ptr<BatchItem>> page_item(const LogKey& log, const std::string& cursor, nlohmann::json response);
/// The log of `cursor` no longer exists and a new one begins.
std::shared_ptr<BatchItem> change_item(const LogKey& log, const std::string& cursor);
/// An event of prismd, {time_s, severity, kind, text}. Returns null for one without a valid time.
std::shared_ptr<BatchItem> event_item(const std::string& gyro, const nlohmann::json& event);
/// Line of kPlaces: the cursor of a page, its last stored row and their number. Empty for other items.
std::string place_line(const BatchItem& item);

/// The columns of COPY for kRows, in the order of the fields.
std::string row_columns();

/// A quoted field: at most `max` bytes, without a partial character; invalid UTF-8 and NUL, which PostgreSQL
/// cannot store, become U+FFFD.
std::string csv_text(std::string_view text, std::size_t max = std::string_view::npos);

}  // namespace prism::prismrelay
