// SPDX-License-Identifier: MIT
#include "tools/prismcal/design/stated_prior.hpp"

#include <cmath>

namespace prism::design {

KnownGyro stated_gyro(const std::vector<InputRange>& domain, double bias_sd_deg_per_h, double noise_deg_per_h) {
  constexpr double kSmooth = 0.3, kLength2 = 2, kLinear = 0.3, kQuadratic = 0.1, kDrift = 0.05, kDriftTime_h = 10;
  constexpr double kRuns = 0.08;  // (0.1 sd)² + 1.5 of the drift, as training assumes
  KnownGyro gyro;
  gyro.name = "the stated prior";
  const auto d = static_cast<Eigen::Index>(domain.size());
  gyro.normalisation = {Eigen::VectorXd(d), Eigen::VectorXd(d), 0, bias_sd_deg_per_h};
  for (Eigen::Index i = 0; i < d; ++i) {
    const InputRange& range = domain[static_cast<std::size_t>(i)];
    gyro.inputs.push_back(range.input);
    gyro.normalisation.input_shift[i] = (range.low + range.high) / 2;
    gyro.normalisation.input_scale[i] = (range.high - range.low) / std::sqrt(12.0);
  }
  const double noise = noise_deg_per_h / bias_sd_deg_per_h;
  gyro.variances.kernel = {kSmooth, Eigen::VectorXd::Constant(d, kLength2), kLinear, kQuadratic};
  gyro.variances.nuisance = kDrift;
  gyro.variances.nuisance_time_h = kDriftTime_h;
  gyro.variances.noise = noise * noise;
  gyro.spread.nuisance_deg_per_h = std::sqrt(kDrift) * bias_sd_deg_per_h;
  gyro.spread.offset_deg_per_h = std::sqrt(kRuns) * bias_sd_deg_per_h;
  gyro.spread.noise_deg_per_h = noise_deg_per_h;
  return gyro;
}

}  // namespace prism::design
