// SPDX-License-Identifier: MIT
// Specification limits: reads them and checks measured values against them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/json_section.hpp"
#include "tools/prismcal/recording_report.hpp"

namespace prism::analysis {

struct Limit {
  std::string quantity;  ///< one of measured_names()
  std::optional<double> min, max;
};

/// Reads an object { "QUANTITY": {"min": a, "max": b}, … }. Errors: an unknown quantity, a limit without min and max,
/// no limit.
std::vector<Limit> limits_in(const Section& section);
/// The same from JSON text; comments are allowed.
Result<std::vector<Limit>> parse_limits(std::string_view text, const std::string& where);

/// "at least 30", "at most 1", "30 to 50".
std::string range_text(const Limit& limit);

/// Reads limits from a file. Returns an empty list if `path` is empty.
Result<std::vector<Limit>> read_limits(const std::string& path);

struct LimitCheck {
  Limit limit;
  Measured measured;
  bool pass = false;  ///< false if the value could not be measured, or is an upper bound and has a minimum
};

std::vector<LimitCheck> check_limits(const std::vector<Limit>& limits, const std::vector<Measured>& measured);
/// All checks, by the name of the recording.
report::Table limits_table(const std::vector<std::pair<std::string, std::vector<LimitCheck>>>& recordings);

}  // namespace prism::analysis
