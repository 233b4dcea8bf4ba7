// SPDX-License-Identifier: MIT
// Specification limits: reads them and checks measured values against them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/prismcal/analysis/recording_report.hpp"

namespace prism::analysis {

struct Limit {
  std::string quantity;  ///< one of measured_names()
  std::optional<double> min, max;
};

/// Parses a JSON object { "QUANTITY": {"min": a, "max": b}, … }; comments are allowed. Errors, with the JSON pointer:
/// a quantity that is not one of `names`, an unknown key, a limit without min and max, no limit, invalid JSON.
Result<std::vector<Limit>> parse_limits(std::string_view text, const std::string& where,
                                        const std::vector<std::string>& names = measured_names());

/// "at least 30", "at most 1", "30 to 50".
std::string range_text(const Limit& limit);

/// Reads limits from a file. Returns an empty list if `path` is empty.
Result<std::vector<Limit>> read_limits(const std::string& path);

struct LimitCheck {
  Limit limit;
  Measured measured;
  bool pass = false;  ///< false if the value could not be measured
};

std::vector<LimitCheck> check_limits(const std::vector<Limit>& limits, const std::vector<Measured>& measured);
report::Table limits_table(const std::vector<LimitCheck>& checks, const std::string& id, const std::string& recording);

}  // namespace prism::analysis
