// SPDX-License-Identifier: MIT
// Builds frames from the same description that decodes them: the simulator and the round-trip tests speak through it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "drivers/wire/description/frame_description.hpp"
#include "drivers/wire/description/frame_view.hpp"

namespace prism::wire {

/// What the device would measure over one frame's interval.
struct GyroState {
  std::array<double, kMaxAxes> rate_deg_per_h{};  ///< mean over the interval, as FrameDescription::axes
  double interval_s = 0;                          ///< > 0
  double temperature_degc = 0;                ///< kUnknown: the frame says that it is not there, where it can say so
  double uhfo_v = 0;                          ///< kUnknown: the same
  std::array<double, kMaxSensors> sensors{};  ///< as FrameDescription::sensors; kUnknown as above
  std::uint32_t status = 0;                   ///< bits besides those that say "valid", which the encoder sets
  std::array<bool, kMaxAxes> valid = all_valid();

  static constexpr std::array<bool, kMaxAxes> all_valid() {
    std::array<bool, kMaxAxes> valid{};
    valid.fill(true);
    return valid;
  }
};

/// Keeps what the device keeps: counter, accumulated angle, and what is left of the angle below one pulse, so that no
/// part of the rate is lost to quantisation. Kinds take their turns as the description's "send" says (else only the
/// first that carries the gyro); multiplexed channels take theirs. Quantities outside what a field can say are held at
/// its limit.
class FrameEncoder {
 public:
  explicit FrameEncoder(FrameDescriptionPtr description);

  /// Appends one whole frame.
  void encode(const GyroState& state, std::vector<std::uint8_t>& out);

  /// The device measured `frames` intervals but sent nothing: the counter goes on, and an accumulated angle with the
  /// state's rate; increments of that time are lost, as they are on a real line.
  void skip(const GyroState& state, std::uint64_t frames);

 private:
  /// A field that says which of several channels a frame carries, and the values it takes in turn.
  struct Selector {
    int field = -1;
    std::vector<std::uint64_t> values;
  };

  void find_selectors();
  void turn(const GyroState& state);
  void write_selectors(int kind);
  void write_counter(const KindRoles& roles);
  void write_axis(const FieldList& fields, const GyroState& state, std::size_t axis);
  void write_channel(const SlowChannel& channel, const ChannelFields& fields, double value, std::uint64_t& latched);
  void write_valid(const AxisRoles& roles, bool valid);
  void write_status(const KindRoles& roles, const GyroState& state);
  double wrapped(std::size_t axis, const Field& field) const;
  const std::uint8_t* find(int field) const;
  void put_number(int field, double raw);
  void put_bits(int field, std::uint64_t bits);

  FrameDescriptionPtr description_;
  std::vector<std::vector<std::uint8_t>> blanks_;  ///< by kind; empty for text kinds
  std::vector<std::vector<Selector>> selectors_;   ///< by kind
  std::uint64_t frame_number_ = 0;
  double ticks_ = 0;  ///< of the counter, modulo its modulus
  /// Units of GyroReading::value: accumulated, or what increments have not carried yet.
  std::array<double, kMaxAxes> angles_{};
  std::uint64_t latched_temperature_ = 0;  ///< the joined number of which the high half was sent
  std::uint64_t latched_uhfo_ = 0;
  std::vector<std::uint64_t> latched_sensors_;

  const FrameKind* kind_ = nullptr;  ///< of the frame in work
  std::vector<std::uint8_t> frame_;
  std::vector<double> raw_;  ///< a text frame's numbers by field
  FrameView view_;
};

}  // namespace prism::wire
