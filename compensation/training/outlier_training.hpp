// SPDX-License-Identifier: MIT
// A robust training of a record with gross outliers: of its other rows.
#pragma once

#include "compensation/training/methods.hpp"

namespace prism::training {

/// train_checked() without the rows `far` (gross_outliers(); not empty), which the notes name. An error, which names
/// them as well: more than a quarter of the rows.
Result<TrainedModel> train_without(const std::vector<Eigen::Index>& far, const TrainingData& data,
                                   compensation::ModelInfo info, const TrainingSettings& settings,
                                   const TuningProgress& progress, const std::atomic<bool>* stop);

}  // namespace prism::training
