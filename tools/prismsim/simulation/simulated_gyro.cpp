// SPDX-License-Identifier: MIT
#include "tools/prismsim/simulation/simulated_gyro.hpp"

#include <cmath>
#include <numbers>
#include <utility>

namespace prism::simulation {
namespace {

constexpr double kSelfHeating_degc = 4, kInnerLag_s = 4 * 3600;
constexpr double kUhfoAt25_v = 5.32, kUhfoPerBody_v_per_degc = -0.0027, kUhfoPerInner_v_per_degc = -0.0018;
constexpr double kUhfoNoise_v = 0.039, kUhfoNoiseTime_s = 73 * 60;
constexpr double kExtraSlope_deg_per_h_per_degc_per_s = -1.83;
constexpr double kGrid_s = 1;
constexpr double kCaseLag_s = 12 * 60, kCaseHeating_degc = 2, kDraught_degc = 3, kDraughtTime_s = 40 * 60;
constexpr std::uint64_t kDraughtStream = 8;

struct Bump {
  double height_deg_per_h, temperature_degc, width_degc, uhfo_v, width_v;
};
constexpr Bump kBumps[]{
    {-0.010, -25, 14, 5.400, 0.063}, {-0.012, 43, 12, 5.200, 0.033}, {-0.019, 76, 10, 5.255, 0.035}};

GyroTruth between(const GyroTruth& a, const GyroTruth& b, double part) {
  const auto mix = [part](double x, double y) { return x + (y - x) * part; };
  GyroTruth truth;
  for (double GyroTruth::*member : {&GyroTruth::time_s, &GyroTruth::chamber_degc, &GyroTruth::body_degc,
                                    &GyroTruth::inner_degc, &GyroTruth::case_degc, &GyroTruth::slope_degc_per_s,
                                    &GyroTruth::uhfo_v, &GyroTruth::bias_deg_per_h, &GyroTruth::sensor_degc}) {
    truth.*member = mix(a.*member, b.*member);
  }
  for (double BiasComponents::*member :
       {&BiasComponents::thermal, &BiasComponents::hysteresis, &BiasComponents::turn_on, &BiasComponents::warm_up,
        &BiasComponents::flicker, &BiasComponents::mode_hops, &BiasComponents::ageing, &BiasComponents::tilt,
        &BiasComponents::gradient}) {
    truth.causes.*member = mix(a.causes.*member, b.causes.*member);
  }
  return truth;
}

}  // namespace

double paper_bias_deg_per_h(double t, double dtdt, double u) {
  return -1.565 + 8.292e-3 * t + 5.529e-6 * t * t + 26.263 * dtdt + 0.646 * u - 6.494e-2 * u * u - 4.055e-2 * t * dtdt -
         1.562e-3 * t * u - 4.666 * dtdt * u;
}

double local_nonlinearity_deg_per_h(double temperature_degc, double uhfo_v) {
  double sum = 0;
  for (const Bump& bump : kBumps) {
    const double t = (temperature_degc - bump.temperature_degc) / bump.width_degc;
    const double u = (uhfo_v - bump.uhfo_v) / bump.width_v;
    sum += bump.height_deg_per_h * std::exp(-(t * t + u * u) / 2);
  }
  return sum;
}

double smooth_bias_deg_per_h(double t, double dtdt, double u) {
  return 0.020 * std::tanh((t - 20) / 22) + 0.006 * std::sin(2 * std::numbers::pi * t / 60) -
         0.012 * std::tanh(dtdt / 0.006) - 0.05 * (u - 5.32) * (1 + 0.5 * std::tanh(t / 40));
}

SimulatedGyro::SimulatedGyro(ChamberProfile profile, std::uint64_t seed, const BiasModelSettings& truth)
    : profile_(std::move(profile)),
      settings_(truth),
      random_(seed, 0),
      body_share_(-std::expm1(-kGrid_s / truth.axis.body_lag_s)),
      hidden_(truth, profile_.temperature_degc(0), seed + truth.axis.hidden_seed),
      draught_random_(seed, kDraughtStream),
      uhfo_noise_v_(kUhfoNoise_v * random_.normal()),
      draught_degc_(kDraught_degc * draught_random_.normal()) {
  before_.case_degc = before_.body_degc = before_.inner_degc = before_.sensor_degc = profile_.temperature_degc(0);
  before_.causes = hidden_.at_start();
  complete(before_);
  after_ = next_second(before_);
  truth_ = before_;
}

// Values derived from the time, the two temperatures and the noise.
void SimulatedGyro::complete(GyroTruth& truth) const {
  truth.chamber_degc = profile_.temperature_degc(truth.time_s);
  truth.slope_degc_per_s = (truth.chamber_degc + kSelfHeating_degc - truth.body_degc) / settings_.axis.body_lag_s;
  truth.uhfo_v = kUhfoAt25_v + kUhfoPerBody_v_per_degc * (truth.body_degc - 25) +
                 kUhfoPerInner_v_per_degc * (truth.inner_degc - truth.body_degc) + uhfo_noise_v_;
  const double t = truth.body_degc, slope = truth.slope_degc_per_s, u = truth.uhfo_v;
  const double thermal = settings_.smooth
                             ? smooth_bias_deg_per_h(t, slope, u)
                             : paper_bias_deg_per_h(t, slope, u) + kExtraSlope_deg_per_h_per_degc_per_s * slope +
                                   local_nonlinearity_deg_per_h(t, u);
  const double age_days = settings_.age_days + truth.time_s / 86400;
  const double grown = 1 + settings_.thermal_ageing_per_day * age_days;
  truth.causes.thermal = settings_.axis.thermal_share * grown * thermal;
  truth.causes.gradient = settings_.gradient_deg_per_h_per_degc * (truth.case_degc - truth.body_degc);
  truth.bias_deg_per_h = truth.causes.sum();
}

// Each lag is exact for an input that is constant at its value in the middle of the second.
GyroTruth SimulatedGyro::next_second(const GyroTruth& from) {
  static const double inner_share = -std::expm1(-kGrid_s / kInnerLag_s);
  static const double noise_kept = std::exp(-kGrid_s / kUhfoNoiseTime_s);
  static const double noise_new_v = kUhfoNoise_v * std::sqrt(1 - noise_kept * noise_kept);
  GyroTruth to;
  to.time_s = from.time_s + kGrid_s;
  const double drive = profile_.temperature_degc(from.time_s + kGrid_s / 2) + kSelfHeating_degc;
  to.body_degc = from.body_degc + (drive - from.body_degc) * body_share_;
  to.inner_degc = from.inner_degc + ((from.body_degc + to.body_degc) / 2 - from.inner_degc) * inner_share;
  const double lag_s = settings_.sensor_lag_s, body_middle = (from.body_degc + to.body_degc) / 2;
  to.sensor_degc =
      lag_s > 0 ? from.sensor_degc - (body_middle - from.sensor_degc) * std::expm1(-kGrid_s / lag_s) : to.body_degc;
  if (settings_.thermometer_in_air) to.sensor_degc = profile_.temperature_degc(to.time_s);
  static const double draught_kept = std::exp(-kGrid_s / kDraughtTime_s);
  static const double draught_new = kDraught_degc * std::sqrt(1 - draught_kept * draught_kept);
  draught_degc_ = draught_degc_ * draught_kept + draught_new * draught_random_.normal();
  const double around = drive - kSelfHeating_degc + kCaseHeating_degc + draught_degc_;
  to.case_degc = from.case_degc - (around - from.case_degc) * std::expm1(-kGrid_s / kCaseLag_s);
  to.causes = hidden_.step(to.time_s, to.body_degc);
  uhfo_noise_v_ = uhfo_noise_v_ * noise_kept + noise_new_v * random_.normal();
  complete(to);
  return to;
}

const GyroTruth& SimulatedGyro::step(double dt_s) {
  const double time_s = truth_.time_s + dt_s;
  while (time_s > after_.time_s) {
    before_ = after_;
    after_ = next_second(before_);
  }
  truth_ = between(before_, after_, (time_s - before_.time_s) / kGrid_s);
  truth_.time_s = time_s;
  return truth_;
}

}  // namespace prism::simulation
