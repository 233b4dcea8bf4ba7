// SPDX-License-Identifier: MIT
// A lot of gyros beside each other: spread, outliers, siblings, and drift since an earlier campaign.
#pragma once

#include "tools/prismcal/campaign/outcome.hpp"

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
std::optional<double> lot_value(const Outcome& outcome, const std::string& quantity);

struct Spread {
  std::size_t count = 0;
  double least = 0, low = 0, median = 0, high = 0, greatest = 0;  ///< low and high: 5 % and 95 %
  double robust_sd = 0;                                           ///< 1.4826 times the median absolute deviation
};
/// Of at least one value.
Spread spread_of(std::vector<double> values);

/// A value further than 3.5 robust sds from the median of its model's lot, of eight values or more (Iglewicz and
/// Hoaglin 1993).
struct Outlier {
  const Outcome* outcome = nullptr;
  std::string quantity;
  double value = 0, score = 0;  ///< score in robust sds
};
inline constexpr double kOutlierScore = 3.5;
std::vector<Outlier> find_outliers(const std::vector<Outcome>& outcomes);

/// Rms difference of two curves of bias against temperature over the bins that both have, and their correlation;
/// nothing below four bins in common.
struct Likeness {
  double difference_deg_per_h = 0, correlation = 0;
};
std::optional<Likeness> compare_curves(const Outcome& a, const Outcome& b);

/// Each gyro and the one that its bias is most like, the most alike first.
struct Sibling {
  const Outcome *outcome = nullptr, *nearest = nullptr;
  Likeness likeness;
};
std::vector<Sibling> find_siblings(const std::vector<Outcome>& outcomes);

/// The same gyro with the same model in an earlier campaign.
struct Drift {
  const Outcome *now = nullptr, *before = nullptr;
  std::optional<double> mean_deg_per_h;   ///< of the training bias: now minus before
  std::optional<double> curve_deg_per_h;  ///< rms of what changed of the bias against temperature
};
std::vector<Drift> find_drift(const std::vector<Outcome>& now, const std::vector<Outcome>& before);

}  // namespace prism::campaign
