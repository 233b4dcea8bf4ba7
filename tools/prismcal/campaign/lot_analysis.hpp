// SPDX-License-Identifier: MIT
// A lot of gyros beside each other: spread, outliers, siblings, and drift since an earlier campaign.
#pragma once

#include "tools/prismcal/campaign/task_result.hpp"

namespace prism::campaign {

/// A quantity of the first repeat that gyros of a lot are compared by.
struct LotQuantity {
  const char* name;
  const char* unit;
};
inline constexpr std::array<LotQuantity, 6> kLotQuantities{{{"before_deg_per_h", "deg/h"},
                                                            {"bias_stability_deg_per_h", "deg/h"},
                                                            {"improvement_percent", "%"},
                                                            {"hysteresis_gap_deg_per_h", "deg/h"},
                                                            {"within_two_sd_percent", "%"},
                                                            {"mean_of_training_deg_per_h", "deg/h"}}};
std::optional<double> lot_value(const TaskResult& outcome, const std::string& quantity);

struct LotStatistics {
  std::size_t count = 0;
  double min = 0, low = 0, median = 0, high = 0, max = 0;  ///< low and high: 5 % and 95 %
  double robust_sd = 0;                                    ///< 1.4826 times the median absolute deviation
};
/// Of at least one value.
LotStatistics statistics_of(std::vector<double> values);

/// A value further than 3.5 robust sds from the median of its model's lot, of eight values or more (Iglewicz and
/// Hoaglin 1993).
struct Outlier {
  const TaskResult* outcome = nullptr;
  std::string quantity;
  double value = 0, score = 0;  ///< score in robust sds
};
inline constexpr double kOutlierScore = 3.5;
std::vector<Outlier> find_outliers(const std::vector<TaskResult>& outcomes);

/// Rms difference of two curves of bias against temperature over the bins that both have, and their correlation;
/// nothing below four bins in common.
struct CurveSimilarity {
  double difference_deg_per_h = 0, correlation = 0;
};
std::optional<CurveSimilarity> compare_curves(const TaskResult& a, const TaskResult& b);

/// Each gyro and the one that its bias is most like, the most alike first.
struct NearestGyro {
  const TaskResult *outcome = nullptr, *nearest = nullptr;
  CurveSimilarity likeness;
};
std::vector<NearestGyro> find_nearest_gyros(const std::vector<TaskResult>& outcomes);

/// The same gyro with the same model in an earlier campaign.
struct Drift {
  const TaskResult *now = nullptr, *before = nullptr;
  std::optional<double> mean_deg_per_h;   ///< of the training bias: now minus before
  std::optional<double> curve_deg_per_h;  ///< rms of what changed of the bias against temperature
};
std::vector<Drift> find_drift(const std::vector<TaskResult>& now, const std::vector<TaskResult>& before);

}  // namespace prism::campaign
