// SPDX-License-Identifier: MIT
// Writes frames with the description that decodes them: encodes them, or edits received ones.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/wire/description/frame_description.hpp"
#include "drivers/wire/description/frame_view.hpp"
#include "drivers/wire/description/message_type.hpp"

namespace prism::wire {

/// Quantities that the device measures over one frame's interval.
struct GyroState {
  std::array<double, kMaxAxes> rate_deg_per_h{};  ///< mean over the interval, as FrameDescription::axes
  double interval_s = 0;                          ///< > 0
  double temperature_degc = 0;                    ///< kUnknown: marked as absent, if the message type allows it
  double uhfo_v = 0;                              ///< kUnknown: the same
  std::array<double, kMaxSensors> sensors{};      ///< as FrameDescription::sensors(); kUnknown as above
  std::uint32_t status = 0;                       ///< bits in addition to the validity bits, which the encoder sets
  std::array<bool, kMaxAxes> valid = {true, true, true, true};
};

/// Keeps the device's state: counter, accumulated angle, and the remainder of the angle below one pulse, so that
/// quantisation loses no rate. Sends the message types in turn as in "send" (else only the first with gyro data);
/// multiplexed channels in turn. Limits quantities to the range of their field.
class FrameEncoder {
 public:
  explicit FrameEncoder(FrameDescriptionPtr description);

  /// False if the next frame would state a number for a quantity that is unknown: an axis that is not valid without a
  /// `valid` rule, or a channel without a value that `when` cannot leave out.
  bool can_state(const GyroState& state) const;

  /// Appends one complete frame. An unknown number without a mark is 0.
  void encode(const GyroState& state, std::vector<std::uint8_t>& out);

  /// The device measured `frames` intervals without sending: the counter advances, and so does an accumulated angle;
  /// increments of that time are lost, as on a real line.
  void skip(const GyroState& state, std::uint64_t frames);

 private:
  /// A field that selects one of several channels of a frame, and the values it takes in turn.
  struct Selector {
    int field = -1;
    std::vector<std::uint64_t> values;
  };

  const MessageType* next_kind() const;  ///< null: none is known yet
  double value_of(std::size_t channel, const GyroState& state) const;
  void find_selectors();
  void begin_frame(int kind, const GyroState& state);
  void turn(const GyroState& state);
  void write_selectors(int kind);
  void write_counter(const MessageFields& roles);
  void write_axis(const FieldList& fields, const GyroState& state, std::size_t axis);
  void write_channel(const Channel& channel, const ChannelFields& fields, double value, std::uint64_t& latched);
  void write_valid(const AxisRoles& roles, bool valid);
  void write_status(const MessageFields& roles, const GyroState& state);
  std::uint8_t* find(const Field& field);  ///< in frame_
  void put_number(int field, double raw);
  void put_bits(int field, std::uint64_t bits);

  FrameDescriptionPtr description_;
  std::vector<std::vector<std::uint8_t>> blanks_;  ///< by message type; empty for text
  std::vector<std::vector<Selector>> selectors_;   ///< by message type
  std::uint64_t frame_number_ = 0;
  double ticks_ = 0;  ///< of the counter, modulo its modulus
  /// In units of AxisReading::value: accumulated, or the remainder that increments have not included yet.
  std::array<double, kMaxAxes> angles_{};
  std::vector<std::uint64_t> latched_;  ///< by channel: the joined number whose high half was sent

  const MessageType* kind_ = nullptr;  ///< of the current frame
  std::vector<std::uint8_t> frame_;
  std::vector<double> raw_;  ///< a text frame's numbers by field
  FrameView view_;
};

/// A number printed as the device printed one, which has no exponent: with its decimals, sign, and zeros in front.
std::string print_like(std::string_view found, double number, char point, bool with_plus = false);

/// Replaces the gyro's numbers in received frames, and computes their checks; every other byte stays.
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

/// The raw number of a quantity, rounded for an integer field. `wrap`: of an accumulated angle: in the range of the
/// field, 0 to wrap or around 0.
double raw_number(const Field& field, double value, double wrap);

/// Appends the lowest `size` bytes of an integer.
void append_number(std::vector<std::uint8_t>& out, std::uint64_t value, std::size_t size, bool big_endian);

}  // namespace prism::wire
