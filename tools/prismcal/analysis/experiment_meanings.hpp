// SPDX-License-Identifier: MIT
// Conclusions for this gyro from the tables and figures of an experiment: one sentence each, computed from the rows.
#pragma once

#include <string>
#include <vector>

#include "tools/prismcal/analysis/experiment.hpp"

namespace prism::analysis {

/// The best of `rows` on the repeat run, and how far the others are from it. Rows are not owned.
std::string best_meaning(const std::vector<const ExperimentRow*>& rows);

/// 1 sigma that the best of `rows` leaves on the training recording and on the repeat run.
std::string fit_meaning(const std::vector<const ExperimentRow*>& rows);

/// The input that alone explains most of the bias. `names` and `correlations` have the same order; NaN: unknown.
std::string correlation_meaning(const std::vector<std::string>& names, const std::vector<double>& correlations);

/// The terms that each model kept.
std::string terms_meaning(const std::vector<const ExperimentRow*>& rows);

/// How many models fail somewhere, and which has the best worst case.
std::string profiles_meaning(const std::vector<const ExperimentRow*>& rows);

/// The tuning with the best mean improvement over all recordings.
std::string tuning_meaning(const std::vector<const ExperimentRow*>& rows);

/// The share of the grid that is almost as good as its best point.
std::string surface_meaning(const std::vector<SurfacePoint>& surface);

}  // namespace prism::analysis
