// SPDX-License-Identifier: MIT
// Converts a good frame to a DecodedMessage: the roles of its fields, and slow channels that are not in every frame.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compensation/sample.hpp"
#include "drivers/wire/description/frame_description.hpp"
#include "drivers/wire/description/frame_view.hpp"

namespace prism::wire {

// One decoded frame before it has a time: passed from the decoder to the clock.

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
  /// The last received value, possibly of an earlier frame, up to Channel::stale_after_s. kUnknown: absent, out of
  /// bounds, or too old.
  double temperature_degc = kUnknown;
  double uhfo_v = kUnknown;                 ///< the same rules
  std::array<double, kMaxSensors> sensors;  ///< as FrameDescription::sensors(); others are uninitialised
  /// False: values of an earlier frame, because sensors of fast frames are not read each time.
  bool sensors_read = false;
  /// The last value, not older than stale_after_s, was outside the min and max of its field, or not convertible. `rate`
  /// is always false: see AxisReading::out_of_bounds.
  QuantitySet out_of_bounds;
  double latency_s = 0;  ///< from the end of the measured interval to the frame's first bit
};

/// The last value of a slow channel and its age in frames.
class SlowValue {
 public:
  /// `rate_hz`: frames per second of the message type that `steps` counts.
  SlowValue(const Channel& channel, double rate_hz);

  /// Processes one frame; `steps` is the number of frames since the last one, `adjacent` is true if none is missing
  /// between them. Complete values come from `fields`; halves are joined only if their frames are adjacent.
  void push(const FrameView& view, const ChannelFields& fields, std::uint64_t steps, bool adjacent);
  double value() const { return age_frames_ <= limit_frames_ ? value_ : kUnknown; }
  bool out_of_range() const { return out_of_range_; }
  /// The last value was a number, but out of range.
  bool out_of_bounds() const { return out_of_bounds_ && age_frames_ <= limit_frames_; }
  void reset();

 private:
  void take_halves(const FrameView& view, int high, int low, bool adjacent);
  void set(double value, bool out_of_bounds);

  const Channel* channel_;
  std::uint64_t limit_frames_ = 0;
  std::uint64_t age_frames_ = 0;
  double value_ = kUnknown;
  bool out_of_range_ = false;          ///< in this frame
  bool out_of_bounds_ = false;         ///< kept as long as the value
  std::optional<std::uint64_t> high_;  ///< of the previous frame
};

/// Sensors are read once in this many frames: about 100 reads per second are enough for one-second means.
std::uint32_t sensor_stride(double frames_hz);

class MessageDecoder {
 public:
  explicit MessageDecoder(FrameDescriptionPtr description);

  /// Fills the data of the frame (not arrival, offset, length). `contiguous`: it directly follows the previous frame.
  /// Returns false if the message type contains neither gyro data, nor the counter, nor a slow channel.
  bool make(std::int32_t kind, const FrameView& view, bool contiguous, DecodedMessage& reading);
  /// Number of field values out of range so far.
  std::uint64_t out_of_range() const { return out_of_range_; }
  /// The first text message whose rate was not a number, at most 60 printable characters; or empty.
  const std::string& unread_text() const { return unread_text_; }
  void reset();

 private:
  void keep_unread(const FrameView& view);
  void read_sensors(const MessageFields& roles, const FrameView& view, DecodedMessage& reading);
  bool sensors_turn(std::int32_t kind);
  void read_counter(const MessageFields& roles, const FrameView& view, bool contiguous, DecodedMessage& reading);
  void read_axis(const AxisRoles& roles, const FrameView& view, AxisReading& reading);

  FrameDescriptionPtr description_;
  std::string unread_text_;
  std::vector<char> tells_;          ///< by message type: whether it contains data
  std::vector<SlowValue> channels_;  ///< as FrameDescription::channels
  std::array<bool, kRoleChannels> has_role_{};
  std::array<double, kMaxSensors> held_;  ///< last values of the sensors
  std::uint32_t stride_ = 1;              ///< sensors are read once in this many frames of a message type
  std::vector<std::uint32_t> waiting_;    ///< by message type: frames left until the next read
  std::uint64_t untold_steps_ = 0;        ///< frames since the last read of the sensors
  std::optional<std::uint64_t> last_counter_;
  std::uint64_t steps_ = 1;
  bool adjacent_ = false;
  std::uint64_t out_of_range_ = 0;
};

}  // namespace prism::wire
