// SPDX-License-Identifier: MIT
// Parses a page of prismd's `rows` to seconds.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "tools/prismweb/period_summary.hpp"

namespace prism::prismweb {

struct LogPage {
  std::vector<PeriodSummary> seconds;  ///< in log order
  std::string after;                   ///< cursor after the last row
  bool more = false;
  std::uint64_t missing = 0;  ///< deleted rows between the cursor and the first row
};

/// Parses `"result":{…}` of a response; skips lines that are not rows. Errors: the response is an error (`where` is its
/// code) or not a page.
Result<LogPage> parse_log_page(std::string_view member);

}  // namespace prism::prismweb
