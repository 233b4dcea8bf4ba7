// SPDX-License-Identifier: MIT
// Minutes and hours of one axis, built from prismd's log, and the place up to which they were.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "tools/prismweb/extremes.hpp"
#include "tools/prismweb/period_file.hpp"

namespace prism::prismweb {

/// A folder: `minutes` and `hours` (PeriodFile), `place.json`. The last one says how many records of the others count,
/// the cursor behind the last row that is in them, and the minute and hour that are open; it is replaced whole, after
/// the others were synced. Whatever is torn was not acknowledged there, and is made again from the log.
class Store {
 public:
  /// Opens it, or begins a new one where there is none or where it is damaged (`begun_anew` says why). Refused where
  /// the folder cannot be written.
  static Result<Store> open(const std::string& folder);

  void push(const Extremes& second);
  /// Keeps what was pushed, which ends at `cursor`.
  Result<void> commit(const std::string& cursor);
  /// Forgets everything: the log is another one.
  Result<void> clear();

  bool has_ended_minute() const { return !ended_minutes_.empty(); }
  const std::string& cursor() const { return cursor_; }  ///< empty: from the beginning
  const std::string& begun_anew() const { return begun_anew_; }
  std::optional<std::int64_t> last_second() const { return last_second_; }
  std::optional<std::int64_t> first_second() const { return first_second_; }
  /// Cursors before the rows of `second`, as far as they are known; where a clock began anew one of each run of it, the
  /// last run first.
  std::vector<std::string> cursors_before(std::int64_t second) const;

  /// Minutes or hours whose begin is within [from_s, to_s), the open one too.
  std::vector<Extremes> minutes(std::int64_t from_s, std::int64_t to_s) const;
  std::vector<Extremes> hours(std::int64_t from_s, std::int64_t to_s) const;

 private:
  Result<void> restore();
  Result<void> append_ended();
  Result<void> write_place() const;

  std::string folder_, cursor_, begun_anew_;
  PeriodFile minute_file_, hour_file_;
  PeriodFolder minute_{60}, hour_{3600};
  std::vector<Extremes> ended_minutes_, ended_hours_;
  std::optional<std::int64_t> first_second_, last_second_;
  std::vector<std::pair<std::int64_t, std::string>> places_;  ///< begin, and a cursor before it
};

}  // namespace prism::prismweb
