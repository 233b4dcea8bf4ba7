// SPDX-License-Identifier: MIT
// A page of prismd's `rows`, as seconds.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "tools/prismweb/period_summary.hpp"

namespace prism::prismweb {

struct LogPage {
  std::vector<PeriodSummary> seconds;  ///< in the order of the log
  std::string after;                   ///< the cursor behind them
  bool more = false;
  std::uint64_t missing = 0;  ///< rows between the cursor and the first one that are deleted
};

/// prismd refuses a cursor of another log with this code.
inline constexpr int kForeignCursor = -32002;

/// Reads the member of an answer, `"result":{…}`. A line that is no row is passed over. Refused where it is an error
/// (`where` is then its code as text) or no page.
Result<LogPage> parse_log_page(std::string_view member);

}  // namespace prism::prismweb
