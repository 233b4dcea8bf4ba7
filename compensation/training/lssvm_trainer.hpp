// SPDX-License-Identifier: MIT
// The two forms of an LSSVM: one centre per sample, or a few centres for a long record.
#pragma once

#include <vector>

#include "compensation/training/trainer.hpp"

namespace prism::training {

/// `settings.reweight` with defaults applied; `point`: c, sigma2 and the weight's parameter.
Result<TrainedModel> train_dense(const NormalisedData& data, compensation::ModelInfo info,
                                 const TrainingSettings& settings, const std::vector<int>& runs,
                                 const TuningPoint& point);
Result<TrainedModel> train_sparse(const NormalisedData& data, compensation::ModelInfo info,
                                  const TrainingSettings& settings, const std::vector<int>& runs,
                                  const ResourcePlan& plan, const TuningPoint& point);

}  // namespace prism::training
