// SPDX-License-Identifier: MIT
// Minutes and hours of one axis, built from prismd's log, and the cursor up to which they were.
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

/// What follows the reason for a store that was damaged.
inline constexpr const char* kRebuilt = "; it is built again from the log";

/// `periods.sqlite` in a directory (docs/page.md, "The store"). commit() writes periods and cursor in one transaction:
/// what a kill takes away is built again from the log.
class PeriodStore {
 public:
  /// Opens it, or creates a new one if there is none or it is damaged (`begun_anew` is then the reason). Errors: the
  /// directory or the file cannot be written, another process uses the file.
  static Result<PeriodStore> open(const std::string& folder);
  /// Removes it, for a log that is another one and after damage.
  static Result<void> remove(const std::string& folder);

  /// Seconds in the order of the log, that end at `cursor`. They are served from now on, and kept by commit().
  void push(std::span<const PeriodSummary> seconds, const std::string& cursor);
  Result<void> commit();

  const std::string& cursor() const { return cursor_; }  ///< of the last push(); empty: from the beginning
  bool is_committed() const { return is_committed_; }    ///< nothing was pushed since the last commit()
  const std::string& rebuild_reason() const { return rebuild_reason_; }
  std::optional<std::int64_t> last_second() const { return last_second_; }
  std::optional<std::int64_t> first_second() const { return first_second_; }
  /// Cursors before the rows of `second`, as far as they are known; where a clock began anew one of each run of it, the
  /// last run first.
  std::vector<std::string> cursors_before(std::int64_t second) const;

  /// Periods whose begin is within [from_s, to_s), of the longest stored length that divides `step_s` (a multiple of
  /// 60); the open one too. One that a push() has a part of is there twice. Errors: the disk cannot be read, or
  /// is_damaged().
  Result<std::vector<PeriodSummary>> periods(std::int64_t step_s, std::int64_t from_s, std::int64_t to_s);
  /// True after an error that means that the file does not contain what was written.
  bool is_damaged() const { return database_.is_damaged(); }

 private:
  using Periods = std::map<std::int64_t, PeriodSummary>;
  struct Table {
    const char* name;
    std::int64_t length_s;
    Periods pushed = {};  ///< by their begin, since the last commit()
  };

  Result<void> load(const std::string& folder);
  Result<std::vector<PeriodSummary>> read(const Table& table, std::int64_t from_s, std::int64_t to_s);
  Result<void> write(const Table& table);
  Result<void> write_all(bool with_place);

  Database database_;
  std::string cursor_, rebuild_reason_;
  bool is_committed_ = true;
  std::array<Table, 3> tables_ = {{{"minutes", 60}, {"ten_minutes", 600}, {"hours", 3600}}};
  std::optional<std::int64_t> first_second_, last_second_;
  std::vector<std::pair<std::int64_t, std::string>> places_;  ///< begin, and a cursor before it
};

}  // namespace prism::prismweb
