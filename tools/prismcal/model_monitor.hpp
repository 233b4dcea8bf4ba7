// SPDX-License-Identifier: MIT
// Does a model still hold in a log? The difference of the corrected rate from the Earth rate, over months at rest.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "compensation/evaluation/drift_test.hpp"
#include "tools/prismcal/model_evaluation.hpp"

namespace prism::analysis {

/// The mean of a window at rest, with a good correction.
struct RestMean {
  std::int64_t second = 0;  ///< its last one
  double temperature_degc = 0, difference_deg_per_h = 0;
  int run = 0;              ///< switch-on, from 0
  double sd_deg_per_h = 0;  ///< of the model, in a new run
};

/// The windows of a recording in which the gyro was at rest inside the training range: their seconds vary as at rest
/// (compensation/at_rest.hpp), and so do at least five neighbours. A gap of a minute, or time that goes back, is a
/// switch-on. Errors: a model without a noise.
Result<std::vector<RestMean>> means_at_rest(const compensation::ModelPtr& model, const recordings::BlockTable& table,
                                            const CorrectionSettings& correction);

/// A mean difference; kUnknown without any.
struct MeanDifference {
  double deg_per_h = kUnknown;
  double within_sd = kUnknown;  ///< of the means of hours, larger by the correlation of neighbours
  double sd = kUnknown;         ///< also of the offsets of switch-ons
};
MeanDifference mean_difference(const std::vector<RestMean>& means, const compensation::MonitorSettings& settings,
                               double window_s);

struct MonitorResult {
  std::string verdict;  ///< "holds", "drifted" or "too_little"
  std::string text;     ///< one sentence
  std::string cause;    ///< the likely one of a drift; else empty
  std::vector<report::Table> tables;

  std::string plain_text() const;
  std::string json_text() const;
};

/// Too little is seen of a log without a drift if it has less than twice the settings' delay at rest, or less than a
/// quarter of the degrees of the training range. A drift ends if no further alarm follows within a week at rest, or
/// twice the delay.
MonitorResult monitor(const compensation::ModelInfo& info, const compensation::MonitorSettings& settings,
                      const std::vector<RestMean>& means, double mount_sd_deg_per_h);

}  // namespace prism::analysis
