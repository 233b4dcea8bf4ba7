// SPDX-License-Identifier: MIT
// Does a model still hold? A two-sided CUSUM (Page 1954) of the corrected rate minus the Earth rate, and its threshold.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "compensation/model.hpp"

namespace prism::evaluation {

/// Takes the differences of a gyro at rest in order of time. z = (difference − offset of the switch-on) / sd; the sums
/// U = max(0, U + z − k) and D = max(0, D − z − k), k = 1/2 for a shift of 1 sd, alarm above the threshold.
///
/// The offset is the mean since the switch-on, with an hour of prior 0, and limited to kOffsets of its standard
/// deviation and kMostOffset sd: a bias that shifts or ages is not taken for offsets. The mean of the first kLevel_h at
/// rest, within kOffsets standard deviations, belongs to all: the axis's direction, and the offset of the run by which
/// the model was trained.
class DriftTest {
 public:
  static constexpr double kAllowance = 0.5, kOffsets = 2, kMostOffset = 0.25, kLevel_h = 168;

  /// `mount_sd`: of the axis's direction, deg/h; `values_per_h`: of the differences.
  DriftTest(const compensation::MonitorSettings& settings, double mount_sd_deg_per_h, double values_per_h);

  /// The gyro was switched on before the next difference.
  void switch_on();
  /// Returns the number of values since the alarm's sum was 0, with the sign of the drift; 0: no alarm. An alarm
  /// restarts both sums.
  int push(double difference_deg_per_h);

  double up() const { return up_.sum; }
  double down() const { return down_.sum; }

 private:
  struct Sum {
    double sum = 0;
    int length = 0;  ///< values since it was 0
    void add(double z) {
      sum = sum + z > 0 ? sum + z : 0;
      length = sum > 0 ? length + 1 : 0;
    }
  };

  compensation::MonitorSettings settings_;
  double most_offset_, most_level_, values_per_h_;
  double first_sum_ = 0, first_count_ = 0;  ///< of the differences of the first kLevel_h
  double sum_ = 0, count_ = 0;              ///< since the switch-on, without the level
  Sum up_, down_;
};

/// Residuals of a model in data that it was not trained on, in order of time.
struct Residuals {
  std::vector<double> deg_per_h;  ///< one per `every` windows
  std::vector<int> recordings;    ///< of each; each with its own switch-on
  int every = 1;
  double window_s = 100;
};

/// The settings for one false alarm in a year at rest, by simulation: years of whole recordings of the residuals; of
/// fewer than three, of moving blocks (at most a day long, at least ten) with a switch-on a day. Of a short record the
/// threshold is larger. A record whose neighbours correlate by more than 0.8 is decimated first. `offset_sd`: of a
/// switch-on, deg/h, at least; its recordings may differ more, or the parts of fewer than three; `least_sd`: of the
/// residuals. Errors (nullopt): fewer than 100 residuals, or constant ones.
std::optional<compensation::MonitorSettings> monitor_settings(Residuals residuals, double offset_sd_deg_per_h,
                                                              double least_sd_deg_per_h);

}  // namespace prism::evaluation
