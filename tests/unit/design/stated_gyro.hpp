// SPDX-License-Identifier: MIT
// A gyro whose covariance is stated: that of the simulated gyros of docs/benchmarks.md, rounded; its model.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "compensation/extrapolation.hpp"
#include "compensation/training/composite.hpp"
#include "tools/prismcal/plan.hpp"

namespace prism::design {

/// `bias_sd_deg_per_h`: spread of the bias over the domain, > 0; `noise_deg_per_h`: of the mean rate of a window of 100
/// s, > 0. Lengths are in standard deviations of each range of the domain.
inline KnownGyro stated_gyro(const std::vector<InputRange>& domain, double bias_sd_deg_per_h, double noise_deg_per_h) {
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

inline constexpr double kScale_deg_per_h = 0.02;

/// T and dT/dt of a cycle of eight hours.
inline RecordedInputs cycle(double phase) {
  RecordedInputs recorded;
  recorded.inputs.resize(2, 120);
  recorded.time_h = Eigen::VectorXd::LinSpaced(120, 0.07, 8);
  for (Eigen::Index i = 0; i < 120; ++i) {
    const double angle = recorded.time_h[i] + phase;
    recorded.inputs.col(i) << 10 + 40 * std::sin(angle), 0.01 * std::cos(angle);
  }
  return recorded;
}

inline Eigen::MatrixXd domain() { return cycle(0.3).inputs; }

inline KnownGyro gyro() {
  KnownGyro known = stated_gyro({{"T", -30, 50}, {"dTdt", -0.01, 0.01}}, kScale_deg_per_h, 0.006);
  known.variances.offset = 0;
  return known;
}

/// A model of this recording whose bias is constant: its sd is that of the design's stated prior if the mean is the
/// bias.
inline compensation::ModelPtr model_of(const KnownGyro& known, const RecordedInputs& recorded) {
  compensation::CompositeParameters p;
  p.variances = known.variances;
  p.normalisation = known.normalisation;
  p.centres = (recorded.inputs.colwise() - known.normalisation.input_shift).array().colwise() /
              known.normalisation.input_scale.array();
  const Eigen::Index n = p.centres.cols();
  p.alpha = Eigen::VectorXd::Zero(n);
  p.beta = 1;  // one scale from the mean, as the design assumes without a model
  p.weight = Eigen::VectorXd::Ones(n);
  p.time_h = recorded.time_h;
  p.recording.assign(static_cast<std::size_t>(n), 0);
  p.trust.level = compensation::nuisance_level(p.variances, p.time_h, p.recording);
  const double drift = p.variances.nuisance - p.trust.level;
  compensation::ModelInfo info;
  info.kind = "composite";
  info.inputs = known.inputs;
  info.spread = known.spread;
  info.spread->nuisance_deg_per_h = kScale_deg_per_h * std::sqrt(drift);
  info.spread->offset_deg_per_h =
      kScale_deg_per_h * std::sqrt(std::pow(compensation::kAssumedOffset, 2) + training::kDaysDiffer * drift);
  return compensation::CompositeModel::make(info, p).value();
}

}  // namespace prism::design
