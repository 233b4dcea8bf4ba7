// SPDX-License-Identifier: MIT
// Parses a page of prismd's `rows` to seconds.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tools/client/response.hpp"
#include "tools/prismweb/period_summary.hpp"

namespace prism::prismweb {

struct LogPage {
  std::vector<PeriodSummary> seconds;  ///< in log order
  std::string after;                   ///< cursor after the last row
  bool more = false;
  std::uint64_t missing = 0;  ///< deleted rows between the cursor and the first row
};

/// Parses the response of `axis`; skips lines that are not rows. Errors: those of the response; kFailed if it is not a
/// page.
tl::expected<LogPage, client::RequestError> parse_log_page(std::string_view member, const std::string& axis);

}  // namespace prism::prismweb
