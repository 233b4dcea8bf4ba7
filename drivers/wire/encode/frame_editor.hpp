// SPDX-License-Identifier: MIT
// Replaces the gyro's numbers in received frames, and computes their checks; every other byte stays.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/wire/description/frame_description.hpp"
#include "drivers/wire/description/frame_view.hpp"

namespace prism::wire {

/// A number printed as the device printed one, which has no exponent: with its decimals, sign, and zeros in front.
std::string print_like(std::string_view found, double number, char point, bool with_plus = false);

class FrameEditor {
 public:
  explicit FrameEditor(FrameDescriptionPtr description) : description_(std::move(description)) {}

  /// A good frame of a message type (index into FrameDescription::kinds).
  void begin(std::int32_t kind, std::span<const std::uint8_t> frame);
  /// Writes AxisReading::value of an axis into each of its fields, rounded to their unit. Returns the value that the
  /// frame now has, modulo AxisRule::wrap; kUnknown, without any change, if the field cannot have it.
  double put(std::size_t axis, double value);
  /// Sets the bits that mark a corrected frame. Returns false if none are described for this message type.
  bool mark();
  /// The frame with its checks. Valid until the next begin().
  std::span<const std::uint8_t> finish();

 private:
  bool write(std::size_t index, double value, double wrap);
  bool write_text(const Field& field, double raw);

  FrameDescriptionPtr description_;
  const MessageType* kind_ = nullptr;
  std::vector<std::uint8_t> frame_, before_;
  FrameView view_;
  // The device's way to print, as seen so far.
  bool lower_case_ = false;  ///< hexadecimal digits of checks
  bool has_plus_ = false;    ///< before numbers from 0
};

}  // namespace prism::wire
