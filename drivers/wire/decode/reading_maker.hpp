// SPDX-License-Identifier: MIT
// From a good frame to a Reading: the roles of its fields, and the slow channels that not every frame carries.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/wire/decode/reading.hpp"
#include "drivers/wire/description/frame_description.hpp"
#include "drivers/wire/description/frame_view.hpp"

namespace prism::wire {

/// The last value of a slow channel and its age in frames.
class SlowValue {
 public:
  /// `rate_hz`: frames a second of the kind that `steps` counts.
  SlowValue(const SlowChannel& channel, double rate_hz);

  /// One frame; `steps` is how many frames the device made since the last one, `adjacent` whether none is missing
  /// between. Whole values come from `fields`; halves are joined only when their frames are adjacent.
  void push(const FrameView& view, const ChannelFields& fields, std::uint64_t steps, bool adjacent);
  double value() const { return age_frames_ <= limit_frames_ ? value_ : kUnknown; }
  bool out_of_range() const { return out_of_range_; }
  /// The last value was a number, but out of range.
  bool out_of_bounds() const { return out_of_bounds_ && age_frames_ <= limit_frames_; }
  void reset();

 private:
  void take_whole(const FrameView& view, int field, double raw);
  void take_halves(const FrameView& view, int high, int low, bool adjacent);
  void set(double value, bool out_of_bounds);

  const SlowChannel* channel_;
  std::uint64_t limit_frames_ = 0;
  std::uint64_t age_frames_ = 0;
  double value_ = kUnknown;
  bool out_of_range_ = false;   ///< in this frame
  bool out_of_bounds_ = false;  ///< held as long as the value
  int memo_field_ = -1;         ///< the last raw number and what it stood for: temperatures repeat, and logarithms cost
  double memo_raw_ = kUnknown;
  double memo_value_ = kUnknown;
  std::optional<std::uint64_t> high_;  ///< of the frame before
};

/// Every so many frames are read for the sensors: a second's mean needs no more than a hundred.
std::uint32_t sensor_stride(double frames_hz);

class ReadingMaker {
 public:
  explicit ReadingMaker(FrameDescriptionPtr description);

  /// Fills what the frame says (not arrival, offset, length). `contiguous`: it follows the frame before byte by byte.
  /// False where this kind says nothing of the gyro, the counter or a slow channel.
  bool make(std::int32_t kind, const FrameView& view, bool contiguous, Reading& reading);
  /// Field values out of range so far.
  std::uint64_t out_of_range() const { return out_of_range_; }
  void reset();

 private:
  void read_sensors(const KindRoles& roles, const FrameView& view, Reading& reading);
  bool sensors_turn(std::int32_t kind);
  void read_counter(const KindRoles& roles, const FrameView& view, bool contiguous, Reading& reading);
  void read_axis(const AxisRoles& roles, const FrameView& view, GyroReading& reading);

  FrameDescriptionPtr description_;
  std::vector<char> tells_;  ///< by kind: whether it says anything; asked of every frame
  SlowValue temperature_;
  std::vector<SlowValue> sensors_;
  std::array<double, kMaxSensors> held_;  ///< what they said
  std::uint32_t stride_ = 1;              ///< every so many frames of a kind are read for the sensors
  std::vector<std::uint32_t> waiting_;    ///< by kind: how many more are not
  std::uint64_t untold_steps_ = 0;        ///< frames since the sensors were read
  SlowValue uhfo_;
  std::optional<std::uint64_t> last_counter_;
  std::uint64_t steps_ = 1;
  bool adjacent_ = false;
  std::uint64_t out_of_range_ = 0;
};

}  // namespace prism::wire
