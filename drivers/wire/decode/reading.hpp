// SPDX-License-Identifier: MIT
// One decoded frame, before it has a place in time: what the decoder hands to the clock.
#pragma once

#include <array>
#include <cstdint>

#include "compensation/sample.hpp"
#include "drivers/wire/description/wire_format.hpp"

namespace prism::wire {

/// What a frame says of one input axis.
struct GyroReading {
  /// In the description's own unit; AxisRule::scale turns it into deg/h or arcsec. Whole numbers (pulses) stay exact,
  /// so differences of an accumulated angle are exact too.
  double value = kUnknown;
  bool carried = false;        ///< this kind carries the axis
  bool valid = false;          ///< the number is there, finite, in range, and the frame says it is valid
  bool out_of_bounds = false;  ///< it is there, but outside the min and max of its field
};

struct Reading {
  /// The sensors stay as they are: who has none pays nothing for them.
  Reading() {}  // the default one would set them to zero

  /// When the frame's last byte had arrived: arrival of its chunk minus the wire time of the bytes behind it there.
  std::int64_t arrival_ns = 0;
  std::uint64_t offset = 0;  ///< of its first byte in the stream since the decoder was made
  std::uint32_t length = 0;  ///< bytes
  std::uint32_t behind = 0;  ///< bytes that came behind it in its chunk: a chunk that waited brings many
  std::int32_t kind = 0;     ///< index into FrameDescription::kinds
  bool has_gyro = false;     ///< this kind carries an axis (others may carry the counter or temperature)
  bool has_counter = false;
  std::uint32_t status = 0;                ///< the device's status bits as sent
  std::uint64_t counter = 0;               ///< as sent, below CounterRule::modulus
  std::array<GyroReading, kMaxAxes> gyro;  ///< as FrameDescription::axes
  double temperature_degc = kUnknown;      ///< kUnknown: absent, out of range, or older than its limit
  double uhfo_v = kUnknown;
  std::array<double, kMaxSensors> sensors;  ///< as FrameDescription::sensors; others are not set
  bool sensors_read = false;                ///< else as in a frame before: of fast ones not each is read for them
  /// Carried lately, but outside the min and max of its field; of the rate each axis says it.
  QuantitySet out_of_bounds;
  double latency_s = 0;  ///< from the end of the measured interval to the frame's first bit
};

}  // namespace prism::wire
