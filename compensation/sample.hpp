// SPDX-License-Identifier: MIT
// One measurement of the gyro in engineering units: the output of the drivers and the input of the compensation.
#pragma once

#include <cstdint>
#include <limits>

namespace prism {

/// A quantity that this sample does not contain (invalid, stale or not measured). Never written to a log or socket.
inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// A set of the quantities of a sample.
struct QuantitySet {
  bool rate = false, temperature = false, uhfo = false;

  bool any() const { return rate || temperature || uhfo; }
  bool operator==(const QuantitySet&) const = default;
};

struct Sample {
  /// End of the interval that the rate is averaged over; nanoseconds since 1970 UTC (clock "host"), or since the device
  /// clock's epoch (clock "device"). Never decreases within a session.
  std::int64_t time_ns = 0;
  /// Mean rate over the interval, deg/h (= arcsec/s); kUnknown if the frame marks it as invalid.
  double rate_deg_per_h = kUnknown;
  /// Length of that interval, s; > 0. The weight of the rate in every mean.
  double interval_s = 0;
  double temperature_degc = kUnknown;
  double uhfo_v = kUnknown;
  /// Number of frames lost just before this one, according to the frame counter.
  std::uint32_t missing_frames = 0;
  /// The device's own status bits, as sent; 0 if the frame has none.
  std::uint32_t status = 0;
  /// Quantities outside the min or max of their field in the frame description: unknown, and implausible.
  QuantitySet out_of_bounds;
  /// Frames arrive at another rate than described: times, slopes and rates of increments are wrong by this factor.
  bool clocks_differ = false;
};

}  // namespace prism
