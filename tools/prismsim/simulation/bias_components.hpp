// SPDX-License-Identifier: MIT
// Components of a simulated gyro's bias, including those that models of T, dT/dt and U cannot explain.
#pragma once

#include <array>
#include <cstdint>

#include "tools/prismsim/simulation/random_source.hpp"

namespace prism::simulation {

/// Differences between the axes of a device: lag of the body and factor of the thermal bias.
struct AxisModel {
  double body_lag_s = 65 * 60;    ///< behind the chamber
  double thermal_share = 1;       ///< of BiasComponents::thermal
  std::uint64_t hidden_seed = 0;  ///< added to the seed of the hidden causes; the UHFO's noise is common to the device
};

/// Sizes; 0: without this cause. All but the first three, and the age, are added to the bias.
struct BiasModelSettings {
  AxisModel axis;
  bool smooth = false;              ///< the smooth non-quadratic bias instead of the paper's equation
  bool thermometer_in_air = false;  ///< in the chamber's, not in the gyro
  double sensor_lag_s = 0;          ///< lag of the thermometer behind the body, which drives the bias
  double hysteresis_deg_per_h = 0;  ///< half the gap between heating and cooling
  double turn_on_deg_per_h = 0;     ///< 1 sigma of an offset sampled at every switch-on
  double warm_up_deg_per_h = 0;     ///< at switch-on; falls to 1/e in an hour
  double flicker_deg_per_h = 0;     ///< B: the Allan deviation is flat at 0.664 B from 10 s to a day
  double mode_hops_deg_per_h = 0;   ///< 1 sigma of the bias levels between mode hops
  double ageing_deg_per_h_per_day = 0;
  double thermal_ageing_per_day = 0;  ///< growth of the thermal bias, share of it
  double age_days = 0;                ///< at the switch-on, for both
  double tilt_deg_per_h = 0;          ///< amplitude: the floor tilts with the sun, once a day
  /// Per (case − body), deg/h per degC: only a thermometer at the case detects it.
  double gradient_deg_per_h_per_degc = 0;

  /// The truths of docs/benchmarks.md: thermometer, hysteresis, warm-up, flicker and mode hops together.
  static BiasModelSettings hard();
};

/// Bias components, deg/h.
struct BiasComponents {
  double thermal = 0;  ///< from T, dT/dt and U
  double hysteresis = 0, turn_on = 0, warm_up = 0, flicker = 0, mode_hops = 0, ageing = 0, tilt = 0;
  double gradient = 0;  ///< from the case minus the body

  /// Components that no thermometer detects.
  double hidden() const { return hysteresis + turn_on + warm_up + flicker + mode_hops + ageing + tilt; }
  double sum() const {
    return thermal + hysteresis + turn_on + warm_up + flicker + mode_hops + ageing + tilt + gradient;
  }
};

/// All components except `thermal`, computed once per second:
///   hysteresis  size · (body − z)/w, z the play operator of half-width w = 15 degC driven by the body
///   flicker     ten Ornstein-Uhlenbeck processes, tau from 3 s to 9 days by factors of 4, variance B² ln 4 / π each
///   mode_hops   a new level N(0, size²) after every Exp(25 degC) of the body's path
///   tilt        size · sin(2π t / 86 400 s + phase)
class HiddenBias {
 public:
  HiddenBias(const BiasModelSettings& settings, double body_degc, std::uint64_t seed);

  /// Advances by one second; returns the components at its end.
  BiasComponents step(double time_s, double body_degc);
  /// At switch-on.
  BiasComponents at_start() const { return causes_; }

 private:
  static constexpr std::size_t kFlickers = 10;

  void set_slow_causes(double time_s, double body_degc);

  BiasModelSettings settings_;
  RandomSource flicker_noise_, hop_noise_;
  std::array<double, kFlickers> flicker_{};
  double play_degc_, last_body_degc_, path_left_degc_, phase_;
  BiasComponents causes_;
};

}  // namespace prism::simulation
