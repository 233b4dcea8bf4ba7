// SPDX-License-Identifier: MIT
// Specification limits: a file of them, and PASS or FAIL for what was measured.
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

/// A value measured on one recording; nullopt if the recording does not determine it.
struct Measured {
  std::string quantity, unit;
  std::optional<double> value;
};

/// The quantities that limits can be put on.
std::vector<std::string> measured_names();
std::vector<Measured> measure_all(const EvaluatedRecording& recording);

/// A JSON object { "QUANTITY": {"min": a, "max": b}, … }, comments allowed. Refused with its pointer: an unknown
/// quantity or key, a limit without min and max, no JSON.
Result<std::vector<Limit>> parse_limits(std::string_view text, const std::string& where);

/// The same from a file; none without a path.
Result<std::vector<Limit>> read_limits(const std::string& path);

struct LimitCheck {
  Limit limit;
  Measured measured;
  bool pass = false;  ///< what could not be measured does not pass
};

std::vector<LimitCheck> check_limits(const std::vector<Limit>& limits, const std::vector<Measured>& measured);
report::Table limits_table(const std::vector<LimitCheck>& verdicts, const std::string& id,
                           const std::string& recording);

}  // namespace prism::analysis
