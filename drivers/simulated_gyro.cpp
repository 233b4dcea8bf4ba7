// SPDX-License-Identifier: MIT
#include "drivers/simulated_gyro.hpp"

#include <cmath>
#include <utility>

namespace prism::drivers {
namespace {

constexpr double kBodyLag_s = 65 * 60, kSelfHeating_degc = 4, kInnerLag_s = 4 * 3600;
constexpr double kUhfoAt25_v = 5.32, kUhfoPerBody_v_per_degc = -0.0027, kUhfoPerInner_v_per_degc = -0.0018;
constexpr double kUhfoNoise_v = 0.039, kUhfoNoiseTime_s = 73 * 60;
constexpr double kExtraSlope_deg_per_h_per_degc_per_s = -1.83;
constexpr double kGrid_s = 1;

struct Bump {
  double height_deg_per_h, temperature_degc, width_degc, uhfo_v, width_v;
};
constexpr Bump kBumps[]{
    {-0.010, -25, 14, 5.400, 0.063}, {-0.012, 43, 12, 5.200, 0.033}, {-0.019, 76, 10, 5.255, 0.035}};

GyroTruth between(const GyroTruth& a, const GyroTruth& b, double part) {
  const auto mix = [part](double x, double y) { return x + (y - x) * part; };
  return {mix(a.time_s, b.time_s),
          mix(a.chamber_degc, b.chamber_degc),
          mix(a.body_degc, b.body_degc),
          mix(a.inner_degc, b.inner_degc),
          mix(a.slope_degc_per_s, b.slope_degc_per_s),
          mix(a.uhfo_v, b.uhfo_v),
          mix(a.bias_deg_per_h, b.bias_deg_per_h)};
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

SimulatedGyro::SimulatedGyro(ChamberProfile profile, std::uint64_t seed)
    : profile_(std::move(profile)), random_(seed, 0), uhfo_noise_v_(kUhfoNoise_v * random_.normal()) {
  before_.body_degc = before_.inner_degc = profile_.temperature_degc(0);
  complete(before_);
  after_ = next_second(before_);
  truth_ = before_;
}

// Everything that follows from the time, the two temperatures and the noise.
void SimulatedGyro::complete(GyroTruth& truth) const {
  truth.chamber_degc = profile_.temperature_degc(truth.time_s);
  truth.slope_degc_per_s = (truth.chamber_degc + kSelfHeating_degc - truth.body_degc) / kBodyLag_s;
  truth.uhfo_v = kUhfoAt25_v + kUhfoPerBody_v_per_degc * (truth.body_degc - 25) +
                 kUhfoPerInner_v_per_degc * (truth.inner_degc - truth.body_degc) + uhfo_noise_v_;
  truth.bias_deg_per_h = paper_bias_deg_per_h(truth.body_degc, truth.slope_degc_per_s, truth.uhfo_v) +
                         kExtraSlope_deg_per_h_per_degc_per_s * truth.slope_degc_per_s +
                         local_nonlinearity_deg_per_h(truth.body_degc, truth.uhfo_v);
}

// Each lag is exact for what drives it held at the middle of the second.
GyroTruth SimulatedGyro::next_second(const GyroTruth& from) {
  static const double body_share = -std::expm1(-kGrid_s / kBodyLag_s);
  static const double inner_share = -std::expm1(-kGrid_s / kInnerLag_s);
  static const double noise_kept = std::exp(-kGrid_s / kUhfoNoiseTime_s);
  static const double noise_new_v = kUhfoNoise_v * std::sqrt(1 - noise_kept * noise_kept);
  GyroTruth to;
  to.time_s = from.time_s + kGrid_s;
  const double drive = profile_.temperature_degc(from.time_s + kGrid_s / 2) + kSelfHeating_degc;
  to.body_degc = from.body_degc + (drive - from.body_degc) * body_share;
  to.inner_degc = from.inner_degc + ((from.body_degc + to.body_degc) / 2 - from.inner_degc) * inner_share;
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

}  // namespace prism::drivers
