// SPDX-License-Identifier: MIT
// The one place where seconds become features: 1 s buckets in, one window out for each.
#pragma once

#include <deque>
#include <vector>

#include "compensation/features.hpp"

namespace prism::compensation {

/// Live, replay and training all push their buckets through this class; a second copy would become bias.
///
/// A window is full (warm_s == history_s()) when buckets of that many seconds stand behind it with no hole longer than
/// max_gap_s; it is ready when it is full and its mean rate, mean temperature and slope are known. A temperature or a
/// UHFO voltage that was not known for longer than max_gap_s within the window has no mean (and no slope): what a
/// sensor said before it failed is not served as news. Devices without UHFO have ready windows with its mean kUnknown.
/// What a bucket disbelieves counts as not known. Shorter holes cost nothing: means are taken over what is there,
/// slopes with the true times of what is there. Cost: O(history_s) a second; no drift, because nothing is accumulated
/// over windows but the lag filters.
class Conditioner {
 public:
  explicit Conditioner(FeatureDefinition definition);

  /// Buckets come in order of time. A bucket that is not later than the one before empties the window (the clock was
  /// set back), as a gap does.
  Window push(const Bucket& bucket);

  /// Forgets everything: a new session of the device.
  void reset();

  const FeatureDefinition& definition() const { return definition_; }

 private:
  void admit(const Bucket& bucket, Window& window);
  void measure(Window& window) const;
  void update_lags(const Bucket& bucket, Window& window);
  double quantity(const Bucket& bucket, std::size_t sensor) const;
  void know(const Bucket& bucket);

  FeatureDefinition definition_;
  std::deque<Bucket> history_;
  std::int64_t warm_since_ = 0;      ///< second of the first bucket since the window was emptied
  SensorList known_list_;            ///< of the last bucket
  std::vector<std::size_t> places_;  ///< where in it each sensor of the definition stands; its size where it does not
  std::vector<double> lag_mean_degc_;
  std::vector<std::vector<double>> sensor_lag_mean_;  ///< by sensor; kUnknown until it was known once
  std::int64_t last_lag_second_ = 0;
  std::int64_t lag_age_s_ = -1;
};

}  // namespace prism::compensation
