// SPDX-License-Identifier: MIT
// The virtual gyro on its wire: truth → noisy frames → bytes, whole, lost, dropped or damaged.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "drivers/wire/encode/frame_encoder.hpp"
#include "tools/prismsim/simulation/simulated_gyro.hpp"

namespace prism::simulation {

/// An axis that the device marks as not valid for a time, s since the gyro was switched on.
struct InvalidTime {
  std::size_t axis = 0;
  double from_s = 0, to_s = 0;
};

struct SimulationSettings {
  ChamberProfile profile = paper_profile();
  TruthSettings truth;
  std::uint64_t seed = 7;
  double rate_hz = 200;  ///< frames a second, > 0
  /// Added to the bias of each axis, as FrameDescription::axes.
  std::array<double, wire::kMaxAxes> earth_rate_deg_per_h{};
  std::vector<InvalidTime> invalid;
  double outliers_per_h = 0;  ///< jumps of the angle by ±2 to ±10 arcsec within one frame
  double lose_frames = 0;     ///< part of the frames that the gyro measures but does not send
  double drop_bytes = 0;      ///< part of the bytes that the line swallows
  double damage_bytes = 0;    ///< part of the bytes that the line changes
};

/// What an axis's bias is made of, 1 sigma, deg/h.
struct BiasParts {
  double own = 0;       ///< of its own temperature and slope, and the voltage
  double gradient = 0;  ///< of the case against the body
  double hidden = 0;    ///< of what no thermometer can see
};

/// What was done to the stream so far: a test knows what a decoder must find.
struct SimulationCounters {
  std::uint64_t frames = 0;  ///< measured
  std::uint64_t lost_frames = 0, dropped_bytes = 0, damaged_bytes = 0, outliers = 0;
  std::uint64_t overrun_bytes = 0;  ///< found no room at a slow reader's
  std::vector<BiasParts> parts;     ///< at the end, by axis
};

/// Axes of one device stand in one chamber; their bodies lag by 65, 52, 81 and 70 minutes, their thermal bias is 1,
/// −0.7, 1.4 and 0.5 times what SimulatedGyro says, and all else of their biases and noise is their own. The frame's
/// temperature and UHFO voltage are the first one's; of the sensors an axis's own thermometer is at its body, others in
/// degC at the case, and those of other units stand still. Each fault draws from a stream of random numbers of its own:
/// asking for damage leaves noise and truth as they were.
class SimulatedLine {
 public:
  SimulatedLine(wire::FrameDescriptionPtr description, const SimulationSettings& settings);

  /// The next frame's interval passes; appends the bytes that reach the other end, if any.
  void next_frame(std::vector<std::uint8_t>& out);

  /// When the last interval ended, ns since the gyro was switched on: frame n at n / rate, without drift.
  std::int64_t time_ns() const;
  /// At that moment.
  const GyroTruth& truth(std::size_t axis = 0) const { return gyros_[axis].truth(); }
  const SimulationCounters& counters() const { return counters_; }
  /// By axis, over the whole seconds so far.
  std::vector<BiasParts> parts() const;

 private:
  double outlier_arcsec();
  void add_parts();
  double sensor_value(std::size_t sensor) const;
  void spoil(std::vector<std::uint8_t>& bytes, std::size_t from);

  SimulationSettings settings_;
  double period_s_;
  std::vector<SimulatedGyro> gyros_;  ///< by axis
  wire::FrameEncoder encoder_;
  std::vector<RandomSource> noise_;  ///< by axis
  RandomSource outliers_, losses_, line_;
  wire::FrameDescriptionPtr description_;
  SimulationCounters counters_;
  struct Spread {
    double sum = 0, squares = 0;
    void add(double value) { sum += value, squares += value * value; }
    double sd(double count) const;
  };
  std::vector<std::array<Spread, 3>> spreads_;  ///< by axis: own, gradient, hidden
  std::int64_t seconds_ = 0;
};

}  // namespace prism::simulation
