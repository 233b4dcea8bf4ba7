// SPDX-License-Identifier: MIT
// Compares the gyros of a lot: distributions, outliers, nearest gyros, and drift since an earlier campaign.
#pragma once

#include "tools/prismcal/campaign/task_result.hpp"

namespace prism::campaign {

/// A quantity by which gyros are compared, measured on the first repeat run or the training recordings.
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
/// Returns nullopt if the result does not contain `quantity`.
std::optional<double> lot_value(const TaskResult& result, const std::string& quantity);

struct LotStatistics {
  std::size_t count = 0;
  double min = 0, low = 0, median = 0, high = 0, max = 0;  ///< low and high: 5th and 95th percentile
  double robust_sd = 0;                                    ///< 1.4826 × median absolute deviation
};
/// `values` must not be empty.
LotStatistics statistics_of(std::vector<double> values);

/// A value more than 3.5 robust sd from the median of all gyros with the same model; needs eight values (Iglewicz and
/// Hoaglin 1993).
struct Outlier {
  const TaskResult* result = nullptr;
  std::string quantity;
  double value = 0, score = 0;  ///< score: distance from the median in robust sd
};
inline constexpr double kOutlierScore = 3.5;
/// Returns the outliers, largest |score| first.
std::vector<Outlier> find_outliers(const std::vector<TaskResult>& results);

/// Rms difference and correlation of two bias-temperature curves over their common temperature bins.
struct CurveSimilarity {
  double difference_deg_per_h = 0, correlation = 0;
};
/// Returns nullopt if the curves have fewer than four common bins.
std::optional<CurveSimilarity> compare_curves(const TaskResult& a, const TaskResult& b);

/// A gyro and the gyro with the most similar bias-temperature curve.
struct NearestGyro {
  const TaskResult *result = nullptr, *nearest = nullptr;
  CurveSimilarity similarity;
};
/// Returns one pair for each gyro, smallest difference first.
std::vector<NearestGyro> find_nearest_gyros(const std::vector<TaskResult>& results);

/// Changes of one gyro with one model since an earlier campaign.
struct Drift {
  const TaskResult *now = nullptr, *before = nullptr;
  std::optional<double> mean_deg_per_h;   ///< change of the mean training bias
  std::optional<double> curve_deg_per_h;  ///< rms change of the bias-temperature curve
};
std::vector<Drift> find_drift(const std::vector<TaskResult>& now, const std::vector<TaskResult>& before);

}  // namespace prism::campaign
