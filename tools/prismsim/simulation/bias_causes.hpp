// SPDX-License-Identifier: MIT
// What a simulated gyro's bias is made of beyond T, dT/dt and U: all that no model of these inputs can know.
#pragma once

#include <array>
#include <cstdint>

#include "tools/prismsim/simulation/random_source.hpp"

namespace prism::simulation {

/// Which of a device's axes a gyro is: its body lags by so much, and its bias leans so far.
struct AxisTruth {
  double body_lag_s = 65 * 60;    ///< behind the chamber
  double thermal_share = 1;       ///< of BiasCauses::thermal
  std::uint64_t hidden_seed = 0;  ///< added to the seed of what no input tells; the UHFO's noise is the device's
};

/// Sizes; 0: the cause is not there. All but the first three are added to the bias.
struct TruthSettings {
  AxisTruth axis;
  bool smooth = false;              ///< the smooth truth, which is no quadratic, instead of the paper's equation
  double sensor_lag_s = 0;          ///< the thermometer lags behind the body that the bias follows
  double hysteresis_deg_per_h = 0;  ///< half the gap between heating and cooling
  double turn_on_deg_per_h = 0;     ///< 1 sigma of an offset drawn at every switch-on
  double warm_up_deg_per_h = 0;     ///< at switch-on; falls to 1/e in an hour
  double flicker_deg_per_h = 0;     ///< B: the Allan deviation is flat at 0.664 B from 10 s to a day
  double mode_hops_deg_per_h = 0;   ///< 1 sigma of the levels between which the cavity hops as it expands
  double ageing_deg_per_h_per_day = 0;
  double tilt_deg_per_h = 0;  ///< amplitude: the floor leans with the sun, once a day
  /// Of (case − body), deg/h per degC: what the body's own thermometer cannot see, and the case's can.
  double gradient_deg_per_h_per_degc = 0;

  /// The truths of docs/science.md: thermometer, hysteresis, warm-up, flicker and mode hops at once.
  static TruthSettings hard();
};

/// The bias by cause, deg/h.
struct BiasCauses {
  double thermal = 0;  ///< of T, dT/dt and U
  double hysteresis = 0, turn_on = 0, warm_up = 0, flicker = 0, mode_hops = 0, ageing = 0, tilt = 0;
  double gradient = 0;  ///< of the case against the body

  /// What no thermometer can see.
  double hidden() const { return hysteresis + turn_on + warm_up + flicker + mode_hops + ageing + tilt; }
  double sum() const {
    return thermal + hysteresis + turn_on + warm_up + flicker + mode_hops + ageing + tilt + gradient;
  }
};

/// Everything but `thermal`, advanced second by second:
///   hysteresis  size · (body − z)/w, z the play operator of half-width w = 15 degC that the body drags along
///   flicker     ten Ornstein-Uhlenbeck processes, tau from 3 s to 9 days by fours, variance B² ln 4 / π each
///   mode_hops   a new level N(0, size²) after every Exp(25 degC) of the body's path
///   tilt        size · sin(2π t / 86 400 s + phase)
class HiddenBias {
 public:
  HiddenBias(const TruthSettings& settings, double body_degc, std::uint64_t seed);

  /// One second on; the causes at its end.
  BiasCauses step(double time_s, double body_degc);
  /// At switch-on.
  BiasCauses at_start() const { return causes_; }

 private:
  static constexpr std::size_t kFlickers = 10;

  void set_slow_causes(double time_s, double body_degc);

  TruthSettings settings_;
  RandomSource flicker_noise_, hop_noise_;
  std::array<double, kFlickers> flicker_{};
  double play_degc_, last_body_degc_, path_left_degc_, phase_;
  BiasCauses causes_;
};

}  // namespace prism::simulation
