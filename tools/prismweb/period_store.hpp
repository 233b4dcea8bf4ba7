// SPDX-License-Identifier: MIT
// Minutes and hours of one axis, built from prismd's log, and the cursor after the last row included.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "tools/prismweb/database.hpp"
#include "tools/prismweb/period_summary.hpp"

namespace prism::prismweb {

/// Suffix of the message about a damaged store.
inline constexpr const char* kRebuilt = "; rebuilding it from the log";

/// `periods.sqlite` in a directory (docs/protocol.md, "The store"). commit() writes periods and cursor in one
/// transaction, so that data lost by a kill is read from the log again.
class PeriodStore {
 public:
  /// Opens the store. Creates a new one if it is missing or damaged (see rebuild_reason()). Errors: the directory or
  /// the file cannot be written, another process uses the file.
  static Result<PeriodStore> open(const std::string& folder);
  /// Removes the store; for a replaced log and after damage.
  static Result<void> remove(const std::string& folder);

  /// Adds seconds in log order; `cursor` is after the last one. periods() includes them; commit() writes them to disk.
  void push(std::span<const PeriodSummary> seconds, const std::string& cursor);
  Result<void> commit();

  const std::string& cursor() const { return cursor_; }  ///< of the last push(); empty: start of the log
  bool is_committed() const { return is_committed_; }    ///< no push() since the last commit()
  /// Why open() replaced the store; empty if it did not.
  const std::string& rebuild_reason() const { return rebuild_reason_; }
  std::optional<std::int64_t> last_second() const { return last_second_; }
  std::optional<std::int64_t> first_second() const { return first_second_; }
  /// Known cursors before the rows of `second`. If the clock restarted, one per clock epoch, the last epoch first.
  std::vector<std::string> cursors_before(std::int64_t second) const;

  /// Returns periods that begin within [from_s, to_s), also incomplete ones, of the longest stored length that divides
  /// `step_s` (a multiple of 60). A period may occur twice: its committed part and its uncommitted part. Errors: the
  /// disk cannot be read, or is_damaged().
  Result<std::vector<PeriodSummary>> periods(std::int64_t step_s, std::int64_t from_s, std::int64_t to_s);
  /// See Database::is_damaged().
  bool is_damaged() const { return database_.is_damaged(); }

 private:
  using Periods = std::map<std::int64_t, PeriodSummary>;
  struct Table {
    const char* name;
    std::int64_t length_s;
    Periods pushed = {};  ///< by begin, since the last commit()
  };

  Result<void> load(const std::string& folder);
  Result<std::vector<PeriodSummary>> read(const Table& table, std::int64_t from_s, std::int64_t to_s);
  Result<void> write(const Table& table);
  Result<void> write_all(bool with_cursor);

  Database database_;
  std::string cursor_, rebuild_reason_;
  bool is_committed_ = true;
  std::array<Table, 3> tables_ = {{{"minutes", 60}, {"ten_minutes", 600}, {"hours", 3600}}};
  std::optional<std::int64_t> first_second_, last_second_;
  std::vector<std::pair<std::int64_t, std::string>> cursors_;  ///< second, and a cursor before its rows
};

}  // namespace prism::prismweb
