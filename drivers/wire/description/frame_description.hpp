// SPDX-License-Identifier: MIT
// A gyro's frames, described in JSON (docs/frames.md): parsed, checked and compiled into immutable tables.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "compensation/sensors.hpp"
#include "drivers/wire/description/commands.hpp"
#include "drivers/wire/description/message_type.hpp"
#include "drivers/wire/description/wire_format.hpp"

namespace prism::wire {

/// Encoding of the gyro's number in a frame.
enum class RateEncoding {
  kRate,         ///< mean rate; AxisRule::scale gives deg/h
  kIncrement,    ///< angle since the previous frame; AxisRule::scale gives arcsec
  kAccumulated,  ///< angle since an arbitrary start, wrapping; AxisRule::scale gives arcsec
};

struct GyroRule {
  RateEncoding meaning = RateEncoding::kRate;
  double interval_s = 0;  ///< increment: duration of an increment, if described; 0: from counter or period
};

/// A served input axis.
struct AxisRule {
  std::string name;      ///< one of FrameDescription::axis_names
  double scale = 1;      ///< one unit of AxisReading::value in deg/h (rate) or arcsec (angle); includes the chosen sign
  double wrap = 0;       ///< accumulated: AxisReading::value is modulo this; 0 if it never wraps
  int thermometer = -1;  ///< its own thermometer: index into FrameDescription::sensors(); -1: the device's temperature

  bool operator==(const AxisRule&) const = default;
};

/// A counter sent by the device: of frames, samples or time ticks.
struct CounterRule {
  std::uint64_t modulus = 0;   ///< the counter runs 0 .. modulus-1; 0 means 2^64
  double ticks_per_frame = 1;  ///< nominal step from one counted frame to the next
  double ticks_per_s = 0;      ///< nominal ticks per second
  /// The step is ticks_per_s / rate_hz; otherwise it is described, for every rate.
  bool step_follows_rate = false;
  bool step_varies = false;  ///< externally triggered: a step other than ticks_per_frame is not a loss

  /// Ticks from one value of the counter to the next one, modulo the modulus; both are below it.
  std::uint64_t ticks_between(std::uint64_t from, std::uint64_t to) const {
    return to - from + (to < from ? modulus : 0);
  }
};

/// Use of a channel by the models: T, U, or an input of its own name.
enum class ChannelRole : std::uint8_t { kTemperature, kUhfo, kSensor };

/// A quantity besides the gyro's, which need not be in every frame.
struct Channel {
  SensorName sensor = {};
  ChannelRole role = ChannelRole::kSensor;
  bool present = false;      ///< exists on the wire: models that use it can be applied
  double stale_after_s = 1;  ///< a value is kept this long over frames without the channel
  /// If two frames contain one half each: value = (high << low_bits | low) as a number of `bits` bits, then scaled.
  int low_bits = 8;
  int bits = 16;
  bool is_signed = false;
  Conversion joined = {};
};

/// The channels of every description, by their roles: first in its list.
inline constexpr std::size_t kRoleChannels = 2;

/// One frame with its expected values: hex or text in the description; run by run_test_vectors().
struct TestVector {
  struct Expectation {
    std::string field;
    double value = 0;
  };
  std::string name;
  std::string where;  ///< its position in the description, for messages
  std::vector<std::uint8_t> bytes;
  std::string kind;  ///< empty if the frame must be rejected
  std::vector<Expectation> expected;
  double tolerance = 1e-6;  ///< relative
};

/// Immutable after parse_frame_description; shared by decoder, encoder and clock.
struct FrameDescription {
  std::string name;    ///< one word: trplg, kvh1750
  std::string title;   ///< one line, human-readable
  std::string source;  ///< source of the format and its verification
  /// 16 hex digits over the canonical text: identifies the description that decoded a log. Plausibility limits and
  /// commands are excluded, because adding one does not change the decoded values.
  std::string id;
  WireFormat wire;
  double rate_hz = 0;            ///< nominal frames per second (with gyro data)
  double rate_tolerance = 0.01;  ///< relative tolerance of rate_hz between devices
  double latency_s = 0;          ///< constant delay from the end of the measured interval to the first bit on the line
  GyroRule gyro;
  std::vector<AxisRule> axes;           ///< served, in the order chosen, at most kMaxAxes; empty: no gyro
  std::vector<std::string> axis_names;  ///< valid values of AxisChoice::axis; the first is the default
  std::optional<CounterRule> counter;
  std::vector<MessageType> kinds;
  std::vector<int> sent_kinds;  ///< sent by an encoder in turn: indices into kinds
  std::vector<TestVector> test_vectors;
  std::vector<std::string> warnings;  ///< one line each: valid, but notable
  /// T and U, also if they are not present; then the sensors, if the choice requests them, else none.
  std::vector<Channel> channels = {{.sensor = {"temperature", "degC"}, .role = ChannelRole::kTemperature},
                                   {.sensor = {"uhfo", "V"}, .role = ChannelRole::kUhfo}};
  Commands commands;                  ///< what the device must be sent
  SensorStatements plausible;         ///< plausibility limits of the device's sensors, if described
  std::uint32_t max_frame_bytes = 0;  ///< longest frame of all message types

  /// False: an instrument without a gyro; it has sensors.
  bool carries_gyro() const { return !axes.empty(); }
  bool has(ChannelRole role) const { return channels[static_cast<std::size_t>(role)].present; }
  std::span<const Channel> sensors() const { return std::span(channels).subspan(kRoleChannels); }
  /// Nominal time between frames with gyro data, s.
  double period_s() const { return 1 / rate_hz; }
  /// True if the counter counts frames, or if there is no counter: time follows from the number of frames.
  bool counts_frames() const { return !counter || counter->ticks_per_frame == 1; }
  /// Nominal rate of frames that the counter counts (of any message type); rate_hz without a counter.
  double counted_rate_hz() const { return counter ? counter->ticks_per_s / counter->ticks_per_frame : rate_hz; }
};

using FrameDescriptionPtr = std::shared_ptr<const FrameDescription>;

/// Settings that a configuration can choose or override.
struct AxisChoice {
  std::string axis = {};                                     ///< empty: the description's first
  double sign = 1;                                           ///< +1 or -1
  std::optional<double> scale_factor_arcsec_per_pulse = {};  ///< > 0; an error if the gyro's number is not in pulses
};
struct GyroChoice {
  std::vector<AxisChoice> axes = {{}};  ///< served axes: at least one, no duplicates; ignored without a gyro
  bool sensors = false;                 ///< include the description's sensors and the axes' own thermometers
  std::optional<double> rate_hz = {};   ///< 0.01 to 100 000, if the gyro's set-up differs from the description
  std::optional<int> baud = {};         ///< the line's own, if it differs from the description
  bool network = false;                 ///< a network line: its speed does not limit the rate
  TextColumns text = {};                ///< for descriptions of text lines without a gyro
};

/// Parses, checks and compiles a description; the text may contain // comments. Errors: `where` (the file) with the
/// JSON pointer or line; found …, expected ….
Result<FrameDescriptionPtr> parse_frame_description(std::string_view text, std::string_view where,
                                                    const GyroChoice& choice = {});

}  // namespace prism::wire
