// SPDX-License-Identifier: MIT
// One decoded frame before it has a time: passed from the decoder to the clock.
#pragma once

#include <array>
#include <cstdint>

#include "compensation/sample.hpp"
#include "drivers/wire/description/wire_format.hpp"

namespace prism::wire {

/// Data of one input axis in a frame.
struct AxisReading {
  /// In the description's unit; AxisRule::scale converts it to deg/h or arcsec. Integers (pulses) are exact, so
  /// differences of an accumulated angle are exact, too.
  double value = kUnknown;
  bool carried = false;        ///< this message type contains the axis
  bool valid = false;          ///< the number is present, finite, in range, and the frame marks it as valid
  bool out_of_bounds = false;  ///< present, but outside the min and max of its field, or not convertible
};

struct DecodedMessage {
  /// User-provided, so that emplace_back() does not zero `sensors`, which costs time.
  DecodedMessage() {}

  /// Arrival of the frame's last byte, ns since 1970 UTC by the host clock: arrival of its chunk minus the wire time of
  /// the bytes after it in the chunk.
  std::int64_t arrival_ns = 0;
  std::uint64_t offset = 0;   ///< of its first byte in the stream since the decoder was created
  std::uint32_t length = 0;   ///< bytes
  std::uint32_t behind = 0;   ///< bytes after it in its chunk: a chunk that waited contains many frames
  std::uint32_t damaged = 0;  ///< frames with gyro data before it, since the last one of those, whose check failed
  std::int32_t kind = 0;      ///< index into FrameDescription::kinds
  bool has_gyro = false;      ///< this message type contains an axis (others may contain the counter or temperature)
  bool has_counter = false;
  std::uint32_t status = 0;                ///< the device's status bits as sent
  std::uint64_t counter = 0;               ///< modulo CounterRule::modulus (0: 2^64); only if has_counter
  std::array<AxisReading, kMaxAxes> gyro;  ///< as FrameDescription::axes
  /// The last received value, possibly of an earlier frame, up to SlowChannel::stale_after_s. kUnknown: absent, out of
  /// bounds, or too old.
  double temperature_degc = kUnknown;
  double uhfo_v = kUnknown;                 ///< the same rules
  std::array<double, kMaxSensors> sensors;  ///< as FrameDescription::sensors; others are uninitialised
  /// False: values of an earlier frame, because sensors of fast frames are not read each time.
  bool sensors_read = false;
  /// The last value, not older than stale_after_s, was outside the min and max of its field, or not convertible. `rate`
  /// is always false: see AxisReading::out_of_bounds.
  QuantitySet out_of_bounds;
  double latency_s = 0;  ///< from the end of the measured interval to the frame's first bit
};

}  // namespace prism::wire
