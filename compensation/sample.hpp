// SPDX-License-Identifier: MIT
// One measurement of the gyro in engineering units: what the drivers hand to the compensation.
#pragma once

#include <cstdint>
#include <limits>

namespace prism {

/// A quantity that this sample does not carry (invalid, stale or not measured). Never written to a log or socket.
inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// Which of a sample's quantities are meant.
struct QuantitySet {
  bool rate = false, temperature = false, uhfo = false;

  bool any() const { return rate || temperature || uhfo; }
  bool operator==(const QuantitySet&) const = default;
};

struct Sample {
  /// Time of the end of the interval the rate is the mean of; nanoseconds since 1970 UTC (clock "host"), or since the
  /// device clock's epoch (clock "device"). Never decreases within a session.
  std::int64_t time_ns = 0;
  /// Mean rate over the interval, deg/h (= arcsec/s); kUnknown where the frame says it is not valid.
  double rate_deg_per_h = kUnknown;
  /// Length of that interval, s; > 0. The weight of the rate in every mean.
  double interval_s = 0;
  double temperature_degc = kUnknown;
  double uhfo_v = kUnknown;
  /// Frames known (by their counter) to be lost just before this one.
  std::uint32_t missing_frames = 0;
  /// The device's own status bits, as sent; 0 where the frame has none.
  std::uint32_t status = 0;
  /// What the frame carried, but beyond the bounds that its description gives the field: unknown, and implausible.
  QuantitySet out_of_bounds;
};

}  // namespace prism
