// SPDX-License-Identifier: MIT
// Recordings for the tables of docs/benchmarks.md: simulated cycles and real ones, on the sample grid of training.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/training/trainer.hpp"
#include "tools/prismsim/simulation/simulated_gyro.hpp"

namespace prism::science {

/// One recording on the grid of training: a row per block.
struct Record {
  training::TrainingData data;
  std::vector<double> true_bias_deg_per_h;  ///< means of the truth over complete blocks; then kUnknown
  Eigen::VectorXd thermal_deg_per_h;        ///< of it, what T, dT/dt and U cause, at the end of each block
  Eigen::VectorXd repeating_deg_per_h;      ///< that and the hysteresis: the part that each cycle repeats
};

/// A cycle of `profile`: 1 s means of the gyro with white rate noise of 0.0064 deg/h in 100 s, 100 s blocks of (T,
/// dT/dt, U). `gyro` other than 0: a gyro of the type, whose thermal bias has its own scale and curvature.
Record simulate(const simulation::ChamberProfile& profile, const simulation::BiasModelSettings& truth,
                std::uint64_t seed, std::uint64_t gyro = 0);

/// The mean of a second of a simulated gyro with white rate noise. `bias_deg_per_h`: the true bias.
compensation::SecondMean measured(const simulation::GyroTruth& now, std::int64_t second, double bias_deg_per_h,
                                  simulation::RandomSource& noise);

/// One-second means of a cycle, to be cut into blocks with several responses.
struct Cycle {
  std::vector<compensation::SecondMean> seconds;
  training::TrainingData blocks(int tau_s) const;
};
Cycle simulate_cycle(const simulation::ChamberProfile& profile, const simulation::BiasModelSettings& truth,
                     std::uint64_t seed);

/// Rows `begin` to `end` (one past the last).
training::TrainingData rows(const training::TrainingData& data, Eigen::Index begin, Eigen::Index end);

/// The chamber recording in ../shared/data: axis "x", "y" or "z", deg/h; inputs T and dT/dt over windows of `window_s`,
/// slopes between ends of 10 s, without the first row.
Result<training::TrainingData> chamber_recording(const std::string& path, const std::string& axis, int window_s);

/// The recordings of one gyro as runs of one training; `one_run`: as if it were one recording, without a gap.
training::TrainingData joined(const std::vector<training::TrainingData>& recordings, bool one_run = false);

/// 1 − rms(after)/rms(before).
double improvement(const Eigen::VectorXd& before, const Eigen::VectorXd& after);
/// The improvement of the target's 1 sigma by a prediction: both about their mean.
double gained(const training::TrainingData& test, const Eigen::VectorXd& prediction);

}  // namespace prism::science
