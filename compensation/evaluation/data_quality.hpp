// SPDX-License-Identifier: MIT
// Checks whether a record is suitable for training: each check has a value, thresholds and a result.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::evaluation {

enum class Verdict { kPass, kWarn, kRefuse };

const char* verdict_text(Verdict verdict);

/// Outside `warn` the result is a warning, outside `refuse` the record is rejected.
struct Threshold {
  double warn = 0, reject = 0;
};

/// The result of one check.
struct Finding {
  std::string name;  ///< temperature_span, length, explainable, moved, disturbed, outliers, noise, quantised
  Verdict verdict = Verdict::kPass;
  double value = 0;
  std::string unit;
  Threshold threshold{};
  bool at_least = true;                ///< the value should be at least (else at most) the threshold
  std::string text{};                  ///< one human-readable line
  std::optional<std::size_t> block{};  ///< the first block concerned, if any
  std::size_t run = 1;                 ///< outliers: consecutive blocks from it
};

struct DataQuality {
  Verdict verdict = Verdict::kPass;    ///< the worst of the findings
  bool nothing_to_compensate = false;  ///< no thermal drift above the noise, or the temperature is constant
  bool constant_temperature = false;
  std::string cause{};            ///< why there is nothing to compensate, if the caller knows
  std::vector<Finding> findings;  ///< in the order above; without moved and disturbed below 8 blocks, without noise
                                  ///< below 24; outliers and quantised only if they do not pass
};

/// How blocks follow each other; empty members: each begins at the end of the one before it.
struct Order {
  std::vector<bool> follows;    ///< block i begins at the end of block i − 1
  std::vector<double> missing;  ///< blocks that are missing before block i; empty: one if it does not follow
};

/// Blocks of one record: means of temperature and rate, as for training. `rate_step_deg_per_h`: step of the rates that
/// were averaged, if it exceeds their noise, else 0. Requires equal lengths and finite values. Errors: fewer than two
/// blocks.
Result<DataQuality> check_data_quality(std::span<const double> temperature_degc, std::span<const double> rate_deg_per_h,
                                       const Order& order, const std::string& where, double rate_step_deg_per_h = 0);

}  // namespace prism::evaluation
