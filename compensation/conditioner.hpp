// SPDX-License-Identifier: MIT
// The one place where seconds become features: 1 s buckets in, one window out for each.
#pragma once

#include <deque>
#include <vector>

#include "compensation/features.hpp"

namespace prism {

/// Live, replay and training all push their buckets through this class; a second copy would become bias.
///
/// A window is ready when buckets of history_s() seconds stand behind it with no hole longer than max_gap_s, and when
/// temperature and rate are known there. UHFO may be unknown (devices without one): its mean is then kUnknown.
/// Cost: O(history_s) a second; no drift, because nothing is accumulated over windows but the lag filters.
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
  double slope(std::int64_t end) const;
  void update_lags(const Bucket& bucket, Window& window);

  FeatureDefinition definition_;
  std::deque<Bucket> history_;
  std::vector<double> lag_mean_degc_;
  std::int64_t last_lag_second_ = 0;
  std::int64_t lag_age_s_ = -1;
};

}  // namespace prism
