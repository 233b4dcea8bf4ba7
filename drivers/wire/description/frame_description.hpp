// SPDX-License-Identifier: MIT
// A gyro's frames, described in JSON (docs/frames.md): parsed, checked and compiled into tables once, then only read.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "compensation/sensor_limits.hpp"
#include "compensation/sensors.hpp"
#include "compensation/text_columns.hpp"
#include "drivers/wire/description/frame_kind.hpp"
#include "drivers/wire/description/wire_format.hpp"

namespace prism::wire {

/// What the gyro's number in a frame is.
enum class GyroMeaning {
  kRate,         ///< mean rate; AxisRule::scale gives deg/h
  kIncrement,    ///< angle turned since the frame before; AxisRule::scale gives arcsec
  kAccumulated,  ///< angle turned since an arbitrary start, wrapping; AxisRule::scale gives arcsec
};

struct GyroRule {
  GyroMeaning meaning = GyroMeaning::kRate;
  double interval_s = 0;  ///< increment: what a number covers where the description says so; 0: from counter or period
};

/// An input axis that is served.
struct AxisRule {
  std::string name;      ///< one of FrameDescription::axis_names
  double scale = 1;      ///< one unit of GyroReading::value in deg/h (rate) or arcsec (angle); carries the chosen sign
  double wrap = 0;       ///< accumulated: GyroReading::value is known modulo this; 0 where it never wraps
  int thermometer = -1;  ///< its own: index into FrameDescription::sensors; -1: the device's temperature
};

/// A counter that the device sends: frames, samples or time ticks.
struct CounterRule {
  std::uint64_t modulus = 0;   ///< the counter runs 0 .. modulus-1; 0 stands for 2^64
  double ticks_per_frame = 1;  ///< nominal step from one counted frame to the next
  double ticks_per_s = 0;      ///< nominal speed
  bool step_varies = false;    ///< externally triggered: a step other than ticks_per_frame is no loss
};

/// A quantity that not every frame need carry: temperature, UHFO voltage.
struct SlowChannel {
  bool present = false;      ///< on the wire at all: a model that takes it can be fed
  double stale_after_s = 1;  ///< a value is held so long over frames that do not carry the channel
  /// Where two frames carry a half each: value = (high << low_bits | low) as a number of `bits` bits, then the scaling.
  int low_bits = 8;
  int bits = 16;
  bool is_signed = false;
  Scaling joined;
};

/// A further channel.
struct SensorRule {
  SensorName sensor;
  SlowChannel channel;
};

/// One frame with the values that stand in it: hex or text in the description; run_test_vectors (decode/inspect.hpp)
/// runs them.
struct TestVector {
  struct Expectation {
    std::string field;
    double value = 0;
    double tolerance = 0;
  };
  std::string name;
  std::string where;  ///< its place in the description, for messages
  std::vector<std::uint8_t> bytes;
  std::string kind;  ///< empty where the frame must be refused
  std::vector<Expectation> expected;
};

/// Immutable after parse_frame_description; shared by decoder, encoder and clock.
struct FrameDescription {
  std::string name;    ///< one word: trplg, kvh1750
  std::string title;   ///< one line for people
  std::string source;  ///< where the format is from and what is proved
  /// 16 hex digits over the canonical text: which description a log was decoded by. What of the numbers is believed is
  /// not in it: a range that is added later changes no byte that was decoded.
  std::string id;
  WireFormat wire;
  double rate_hz = 0;         ///< nominal frames a second (of those that carry the gyro)
  double rate_tolerance = 0;  ///< by which part of rate_hz real devices differ
  double latency_s = 0;       ///< constant delay from the end of the measured interval to the first bit on the line
  GyroRule gyro;
  std::vector<AxisRule> axes;           ///< served, in the order chosen, at most kMaxAxes; empty: carries no gyro
  std::vector<std::string> axis_names;  ///< what AxisChoice::axis may name; the first is the default
  std::optional<CounterRule> counter;
  std::vector<FrameKind> kinds;
  std::vector<int> sent_kinds;  ///< what an encoder sends, in turn: indices into kinds
  std::vector<TestVector> test_vectors;
  std::vector<std::string> warnings;  ///< one line each: legal, but worth knowing
  SlowChannel temperature;
  SlowChannel uhfo;
  /// Where the choice asks for them; those that are known but not asked for are read and left out.
  std::vector<SensorRule> sensors;
  SensorStatements plausible;  ///< what of the device's sensors is to be believed, as far as the description says it
  std::uint32_t max_frame_bytes = 0;  ///< the longest frame of any kind

  /// False: an instrument beside a gyro; it has sensors.
  bool carries_gyro() const { return !axes.empty(); }
  /// Nominal time from one gyro-carrying frame to the next, s.
  double period_s() const { return 1 / rate_hz; }
  /// Nominal frames a second that the counter counts (of any kind); rate_hz without a counter.
  double counted_rate_hz() const { return counter ? counter->ticks_per_s / counter->ticks_per_frame : rate_hz; }
};

using FrameDescriptionPtr = std::shared_ptr<const FrameDescription>;

/// What a configuration may choose or override.
struct AxisChoice {
  std::string axis = {};                                     ///< empty: the description's first
  double sign = 1;                                           ///< +1 or -1
  std::optional<double> scale_factor_arcsec_per_pulse = {};  ///< refused where the gyro's number is not in pulses
};
struct GyroChoice {
  std::vector<AxisChoice> axes = {{}};  ///< to be served: at least one, none twice; no meaning without a gyro
  bool sensors = false;                 ///< the description's sensors, and the axes' own thermometers
  std::optional<double> rate_hz = {};   ///< the gyro's own set-up, where the description's rate is another one
  TextColumns text = {};                ///< for descriptions of lines of text without a gyro
};

/// Reads, checks and compiles a description. Refusals name `where` (the file) and the JSON pointer or line, what was
/// found and what was expected. The text may hold // comments.
Result<FrameDescriptionPtr> parse_frame_description(std::string_view text, std::string_view where,
                                                    const GyroChoice& choice = {});

}  // namespace prism::wire
