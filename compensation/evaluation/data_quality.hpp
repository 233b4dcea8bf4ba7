// SPDX-License-Identifier: MIT
// Whether a record is worth training on: asked before a model is made, answered with every number and threshold.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::evaluation {

enum class Verdict { kPass, kWarn, kRefuse };

const char* verdict_text(Verdict verdict);

/// Beyond `warn` the finding warns, beyond `refuse` the record is refused.
struct Threshold {
  double warn = 0, refuse = 0;
};

struct DataQualitySettings {
  Threshold min_blocks{200, 20};
  Threshold min_temperature_span_degc{25, 10};  ///< a chamber cycle spans 60 or more
  /// Movement with less temperature than this behind it cannot be thermal.
  double still_temperature_degc = 1;
  /// Share of the variance of the blocks above their noise floor: 1 − floor² / sd².
  Threshold min_explainable{0.5, 0.3};
  /// Largest sharp and lasting step between blocks, if it stands eight noise sds high, in sds of all blocks (a step
  /// alone makes 2): the gyro was turned, so that the earth rate in the record changed.
  Threshold max_step{0.25, 1};
  /// Share of the blocks further than eight noise sds from their neighbours' median: bumps, people, trucks.
  Threshold max_disturbed{0.02, 0.10};
  /// Noise of the noisiest quarter of the record over the quietest (of fewer parts where a quarter has below 12
  /// blocks), none taken for less than the quantiser's.
  Threshold max_noise_ratio{3, 10};
};

/// One question and its answer.
struct Finding {
  std::string name;  ///< temperature_span, length, explainable, moved, disturbed, noise, quantised
  Verdict verdict = Verdict::kPass;
  double value = 0;
  std::string unit;
  Threshold threshold{};
  bool at_least = true;                ///< the value should be at least (else at most) the threshold
  std::string text{};                  ///< one line for people
  std::optional<std::size_t> block{};  ///< the first block that it is about, where there is one
};

struct DataQuality {
  Verdict verdict = Verdict::kPass;    ///< the worst finding's
  bool nothing_to_compensate = false;  ///< no thermal movement above the noise
  std::vector<Finding> findings;  ///< in the order above; below 8 blocks without moved and disturbed, below 24 without
                                  ///< noise; quantised where the rate's steps stand above the noise
};

/// Blocks of one record: means of temperature and rate, as training takes them. `follows` as in block_means.hpp, or
/// empty. Refused: lengths that differ, values not finite, fewer than two blocks.
Result<DataQuality> check_data_quality(std::span<const double> temperature_degc, std::span<const double> rate_deg_per_h,
                                       const std::vector<bool>& follows, const DataQualitySettings& settings,
                                       const std::string& where);

}  // namespace prism::evaluation
