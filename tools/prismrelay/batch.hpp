// SPDX-License-Identifier: MIT
// The data of one transaction: rows of any gyros, cursors, gaps, invalid lines and events.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
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

class Batch {
 public:
  enum Table { kRows, kSegments, kPlaces, kGaps, kRefused, kEvents };
  static constexpr std::size_t kTables = 6;

  /// Adds the result of prismd's method `rows` after `cursor`. At most one page of each log per batch. Errors: the
  /// result has an unexpected form; the batch is then unchanged.
  Result<PageSummary> add_page(const LogKey& log, const std::string& cursor, const nlohmann::json& page);
  /// Records that the log of `cursor` no longer exists and a new one starts.
  void add_change_of_log(const LogKey& log, const std::string& cursor);
  /// Adds an event of prismd, {time_s, severity, kind, text}. Ignores one without a valid time.
  void add_event(const std::string& gyro, const nlohmann::json& event);

  bool empty() const;
  std::size_t bytes() const;
  /// CSV lines for COPY.
  const std::string& text(Table table) const { return texts_[table]; }
  const std::set<std::int64_t>& days() const { return days_; }               ///< of arrival, since 1970 UTC
  const std::map<LogKey, std::string>& cursors() const { return cursors_; }  ///< after the last row of each log

 private:
  void add_segment(const std::string& prefix, const nlohmann::json& segment, PageSummary& summary, RowPosition& last);

  std::array<std::string, kTables> texts_;
  std::set<std::int64_t> days_;
  std::map<LogKey, std::string> cursors_;
};

}  // namespace prism::prismrelay
