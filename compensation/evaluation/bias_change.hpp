// SPDX-License-Identifier: MIT
// Distinguishes errors of a model on another recording: a shift or a trend of the bias, or more than the model states.
#pragma once

#include <optional>
#include <span>

namespace prism::evaluation {

struct BiasChange {
  /// With its standard deviation.
  struct Estimate {
    double value, sd;
  };
  std::optional<Estimate> per_day;  ///< trend, deg/h a day; only if certain
  std::optional<double> shift;  ///< mean error, deg/h; only without a trend, and beyond what model and mount explain
  double within = 1;            ///< share of the errors within 2 sd_mean, without trend or shift
  double correlation = 0;       ///< of neighbouring errors, without them

  bool found() const { return per_day || shift; }
};

/// A trend is the slope of the means of days through at least kFewestDays; its standard deviation is that of least
/// squares, larger by the correlation of neighbouring days. It is certain above 4 of them. A shift is explained up to 3
/// standard deviations: the model's stated one, as a mean over the recording, and `mount_sd` of the axis's direction.
/// One value per block, in order of time, at least one; all finite, deg/h.
inline constexpr int kFewestDays = 7;
BiasChange bias_change(std::span<const double> time_s, std::span<const double> error, std::span<const double> sd,
                       std::span<const double> sd_mean, double mount_sd);

}  // namespace prism::evaluation
