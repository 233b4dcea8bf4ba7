// SPDX-License-Identifier: MIT
// The simulated gyro on its line: truth → noisy frames → bytes, intact, lost, dropped or damaged.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "drivers/wire/encode/frame_encoder.hpp"
#include "tools/prismsim/simulation/simulated_gyro.hpp"

namespace prism::simulation {

/// The device marks an axis invalid for a time, s since the gyro was switched on.
struct InvalidTime {
  std::size_t axis = 0;
  double from_s = 0, to_s = 0;
};

struct SimulationSettings {
  ChamberProfile profile = paper_profile();
  BiasModelSettings truth;
  std::uint64_t seed = 7;
  double rate_hz = 200;  ///< frames per second, > 0
  /// Added to the bias of each axis, as FrameDescription::axes.
  std::array<double, wire::kMaxAxes> earth_rate_deg_per_h{};
  std::vector<InvalidTime> invalid;
  double outliers_per_h = 0;  ///< jumps of the angle by ±2 to ±10 arcsec within one frame
  double lose_frames = 0;     ///< share of frames that are measured but not sent
  double drop_bytes = 0;      ///< share of bytes that the line drops
  double damage_bytes = 0;    ///< share of bytes that the line changes
};

/// Components of an axis's bias, 1 sigma, deg/h.
struct BiasParts {
  double own = 0;       ///< from its own temperature, slope and voltage
  double gradient = 0;  ///< from the case minus the body
  double hidden = 0;    ///< not detectable by thermometers
};

/// Faults added so far: a test knows what a decoder must find.
struct SimulationCounters {
  std::uint64_t frames = 0;  ///< measured
  std::uint64_t lost_frames = 0, dropped_bytes = 0, damaged_bytes = 0, outliers = 0;
  std::uint64_t overrun_bytes = 0;  ///< dropped because the reader was slow
  std::vector<BiasParts> parts;     ///< at the end, by axis
};

/// A gyro, or an instrument (a description with sensors only).
///
/// All axes of a device are in one chamber. Their bodies lag by 65, 52, 81 and 70 minutes, their thermal bias is 1,
/// −1.6, 2.2 and 1.3 times that of SimulatedGyro, and all other parts of bias and noise are independent. The frame's
/// temperature and UHFO voltage are those of the first axis. An axis's own thermometer measures its body, other sensors
/// in degC the case; sensors with other units are constant. Each fault has its own stream of random numbers: adding
/// faults does not change noise and truth.
class SimulatedLine {
 public:
  SimulatedLine(wire::FrameDescriptionPtr description, const SimulationSettings& settings);

  /// Simulates the next frame's interval; appends the bytes that reach the other end, if any.
  void next_frame(std::vector<std::uint8_t>& out);

  /// When the last interval ended, ns since the gyro was switched on: frame n at n / rate, without drift.
  std::int64_t time_ns() const;
  /// The truth at that time.
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
  std::vector<SimulatedGyro> gyros_;  ///< by axis; an instrument has one, for the temperatures
  wire::FrameEncoder encoder_;
  std::vector<RandomSource> noise_;  ///< by axis
  RandomSource outliers_, losses_, line_;
  wire::FrameDescriptionPtr description_;
  SimulationCounters counters_;
  struct RunningMoments {
    double sum = 0, squares = 0;
    void add(double value) { sum += value, squares += value * value; }
    double sd(double count) const;
  };
  std::vector<std::array<RunningMoments, 3>> spreads_;  ///< by axis: own, gradient, hidden
  std::int64_t seconds_ = 0;
};

}  // namespace prism::simulation
