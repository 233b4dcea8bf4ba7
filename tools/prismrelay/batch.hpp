// SPDX-License-Identifier: MIT
// What is committed at once: pages of rows of any gyros, their places, and what happened.
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

/// One axis' log: whose rows they are.
struct LogKey {
  std::string gyro;  ///< SITE/NAME
  std::string axis;

  auto operator<=>(const LogKey&) const = default;
};

/// What a page made of a log's place.
struct PageSummary {
  std::string cursor;       ///< behind its last row
  std::size_t rows = 0;     ///< taken
  std::size_t refused = 0;  ///< lines that are no rows
  std::string why = {};     ///< the last of them is no row
  std::uint64_t missing = 0;
  double arrival_s = 0;  ///< of its last row; 0: it has none
  bool more = false;
};

class Batch {
 public:
  enum Table { kRows, kSegments, kPlaces, kGaps, kRefused, kEvents };
  static constexpr std::size_t kTables = 6;

  /// A page that prismd answered `rows` behind `cursor` with. At most one of a log in a batch. Refused, and nothing
  /// taken: it is no such answer.
  Result<PageSummary> add_page(const LogKey& log, const std::string& cursor, const nlohmann::json& page);
  /// The log that `cursor` is of is not there any more: another one begins.
  void add_change_of_log(const LogKey& log, const std::string& cursor);
  /// An event of prismd, {time_s, severity, kind, text}.
  void add_event(const std::string& gyro, const nlohmann::json& event);

  bool empty() const;
  std::size_t bytes() const;
  /// Lines of CSV for COPY.
  const std::string& text(Table table) const { return texts_[table]; }
  const std::set<std::int64_t>& days() const { return days_; }              ///< of arrival, since 1970 UTC
  const std::map<LogKey, std::string>& places() const { return cursors_; }  ///< the cursors that the logs have come to

 private:
  void add_segment(const std::string& prefix, const nlohmann::json& segment, PageSummary& facts, RowPosition& last);

  std::array<std::string, kTables> texts_;
  std::set<std::int64_t> days_;
  std::map<LogKey, std::string> cursors_;
};

}  // namespace prism::prismrelay
