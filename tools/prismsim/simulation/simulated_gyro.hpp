// SPDX-License-Identifier: MIT
// Simulated total-reflection prism gyro in a thermal chamber: temperatures, UHFO voltage and the resulting bias.
#pragma once

#include <cstdint>

#include "tools/prismsim/simulation/bias_components.hpp"
#include "tools/prismsim/simulation/chamber_profile.hpp"
#include "tools/prismsim/simulation/random_source.hpp"

namespace prism::simulation {

/// White rate noise: 0.0064 deg/h in means of 100 s.
inline constexpr double kRateNoise_deg_per_h_sqrt_s = 0.064;

/// State and true bias, which a real gyro does not report.
struct GyroTruth {
  double time_s = 0;  ///< since the gyro was switched on
  double chamber_degc = 0;
  double body_degc = 0;  ///< T
  double inner_degc = 0;
  double slope_degc_per_s = 0;  ///< of the body: dT/dt
  double uhfo_v = 0;            ///< U
  double bias_deg_per_h = 0;    ///< causes.sum()
  double sensor_degc = 0;       ///< output of the PT100: the body, delayed by the configured lag
  BiasComponents causes;
  double case_degc = 0;  ///< of the device, common to all its axes
};

/// The physics, from the chamber to the bias:
///
///   d body/dt  = (chamber + 4 degC − body) / 65 min         first-order lag behind the chamber, self-heating 4 degC
///   d inner/dt = (body − inner) / 4 h                        the discharge, deep in the glass
///   d case/dt  = (chamber + 2 degC + n − case) / 12 min      n: a draught, Ornstein-Uhlenbeck, 3 degC, 40 min
///   U    = 5.32 − 0.0027 (body − 25) − 0.0018 (inner − body) + n    V; n: Ornstein-Uhlenbeck, 0.039 V, 73 min
///   bias = eq25(body, d body/dt, U) − 1.83 d body/dt + local(body, U)    deg/h
///
/// eq25 is equation 25 of Tao et al. 2019, the paper's stepwise model 2. local() is a non-quadratic part, see
/// local_nonlinearity_deg_per_h. BiasModelSettings add components that no model of (T, dT/dt, U) can explain. The gyro
/// is switched on cold: body and inner temperature start at the chamber's. Over seeds 1 to 8 one paper cycle of 100 s
/// means, rate noise included, has correlations with the bias of 0.66 (T), −0.37 (dT/dt) and −0.74 (U) and a 1-sigma of
/// 0.0192 deg/h (the paper's gyro: 0.71, −0.43, −0.82 and 0.0185); single seeds scatter, because a cycle
/// has only about twenty correlation times of the noise of U.
///
/// The equations are solved on a grid of 1 s and interpolated linearly, so that a seed gives the same truth at every
/// frame rate.
class SimulatedGyro {
 public:
  SimulatedGyro(ChamberProfile profile, std::uint64_t seed, const BiasModelSettings& truth = {});

  /// Advances by `dt_s` > 0; returns the truth at its end.
  const GyroTruth& step(double dt_s);

  const GyroTruth& truth() const { return truth_; }
  const ChamberProfile& profile() const { return profile_; }

 private:
  GyroTruth next_second(const GyroTruth& from);
  void complete(GyroTruth& truth) const;

  ChamberProfile profile_;
  BiasModelSettings settings_;
  RandomSource random_;
  double body_share_;
  HiddenBias hidden_;
  RandomSource draught_random_;
  double uhfo_noise_v_ = 0, draught_degc_ = 0;
  GyroTruth before_, after_;  ///< the grid points around truth_
  GyroTruth truth_;
};

/// Three Gaussian hollows over the (T, U) plane, deg/h, from 0 down to −0.02, near the plateaus of the paper's cycle:
///
///   local = Σ h exp(−((T − T0)/w)² / 2 − ((U − U0)/v)² / 2)
///   h, T0, w, U0, v = −0.010, −25, 14, 5.400, 0.063;  −0.012, 43, 12, 5.200, 0.033;  −0.019, 76, 10, 5.255, 0.035
///
/// Our choice. The best quadratic in (T, dT/dt, U) leaves 0.0070 deg/h of a cycle, of which 0.0064 are rate noise; a
/// kernel fits it better, and on a repeat of the cycle removes about 5 % more than the quadratic.
double local_nonlinearity_deg_per_h(double temperature_degc, double uhfo_v);

/// A smooth non-quadratic bias: saturates in T and dT/dt, periodic in T, the effect of U increases with T; deg/h:
///   0.020 tanh((T − 20)/22) + 0.006 sin(2π T/60) − 0.012 tanh(dT/dt / 0.006) − 0.05 (U − 5.32) (1 + 0.5 tanh(T/40))
double smooth_bias_deg_per_h(double temperature_degc, double slope_degc_per_s, double uhfo_v);

/// Equation 25 of the paper, deg/h, of T (degC), dT/dt (degC/s) and U (V).
double paper_bias_deg_per_h(double temperature_degc, double slope_degc_per_s, double uhfo_v);

}  // namespace prism::simulation
