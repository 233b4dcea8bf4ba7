// SPDX-License-Identifier: MIT
#include "tools/prismsim/simulation/bias_components.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace prism::simulation {
namespace {

constexpr double kPlay_degc = 15, kWarmUp_s = 3600, kHopPath_degc = 25, kDay_s = 86400;
constexpr double kShortestFlicker_s = 3, kFlickerRatio = 4;
constexpr std::uint64_t kFlickerStream = 5, kHopStream = 6, kStartStream = 7;

/// Variance of each process: Lorentzians at ratios r sum to the one-sided density B²/(π f) if their variances are B² ln
/// r / π.
double flicker_sd(double b) { return b * std::sqrt(std::log(kFlickerRatio) / std::numbers::pi); }

double exponential(RandomSource& random) { return -std::log1p(-random.uniform()); }

}  // namespace

BiasModelSettings BiasModelSettings::hard() {
  BiasModelSettings hard;
  hard.sensor_lag_s = 300;
  hard.hysteresis_deg_per_h = 0.004;
  hard.turn_on_deg_per_h = 0.003;
  hard.warm_up_deg_per_h = 0.015;
  hard.flicker_deg_per_h = 0.0015;
  hard.mode_hops_deg_per_h = 0.003;
  return hard;
}

HiddenBias::HiddenBias(const BiasModelSettings& settings, double body_degc, std::uint64_t seed)
    : settings_(settings),
      flicker_noise_(seed, kFlickerStream),
      hop_noise_(seed, kHopStream),
      play_degc_(body_degc),
      last_body_degc_(body_degc) {
  RandomSource start(seed, kStartStream);
  causes_.turn_on = settings_.turn_on_deg_per_h * start.normal();
  phase_ = 2 * std::numbers::pi * start.uniform();
  const double each = flicker_sd(settings_.flicker_deg_per_h);
  for (double& process : flicker_) process = each * flicker_noise_.normal();
  causes_.flicker = std::accumulate(flicker_.begin(), flicker_.end(), 0.0);
  causes_.mode_hops = settings_.mode_hops_deg_per_h * hop_noise_.normal();
  path_left_degc_ = kHopPath_degc * exponential(hop_noise_);
  set_slow_causes(0, body_degc);
}

void HiddenBias::set_slow_causes(double time_s, double body_degc) {
  play_degc_ = std::clamp(play_degc_, body_degc - kPlay_degc, body_degc + kPlay_degc);
  causes_.hysteresis = settings_.hysteresis_deg_per_h * (body_degc - play_degc_) / kPlay_degc;
  causes_.warm_up = settings_.warm_up_deg_per_h * std::exp(-time_s / kWarmUp_s);
  causes_.ageing = settings_.ageing_deg_per_h_per_day * (settings_.age_days + time_s / kDay_s);
  causes_.tilt = settings_.tilt_deg_per_h * std::sin(2 * std::numbers::pi * time_s / kDay_s + phase_);
}

BiasComponents HiddenBias::step(double time_s, double body_degc) {
  set_slow_causes(time_s, body_degc);
  if (settings_.flicker_deg_per_h > 0) {
    const double each = flicker_sd(settings_.flicker_deg_per_h);
    double tau_s = kShortestFlicker_s;
    for (double& process : flicker_) {
      const double kept = std::exp(-1 / tau_s);
      process = process * kept + each * std::sqrt(1 - kept * kept) * flicker_noise_.normal();
      tau_s *= kFlickerRatio;
    }
    causes_.flicker = std::accumulate(flicker_.begin(), flicker_.end(), 0.0);
  }
  path_left_degc_ -= std::abs(body_degc - last_body_degc_);
  last_body_degc_ = body_degc;
  if (path_left_degc_ < 0) {
    causes_.mode_hops = settings_.mode_hops_deg_per_h * hop_noise_.normal();
    path_left_degc_ = kHopPath_degc * exponential(hop_noise_);
  }
  return causes_;
}

}  // namespace prism::simulation
