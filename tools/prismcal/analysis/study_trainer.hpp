// SPDX-License-Identifier: MIT
// The study's models, made by the training engine.
#pragma once

#include <atomic>
#include <cstdint>

#include "tools/prismcal/analysis/study.hpp"

namespace prism::analysis {

struct StudyTraining {
  std::string gyro_serial;  ///< the models are bound to it; empty: any gyro
  std::uint64_t seed = 1;   ///< of the shuffled folds
  int folds = 10;
  int reweight_limit = 500;                 ///< weighted solves at most; 1: the paper's single re-weighting
  const std::atomic<bool>* stop = nullptr;  ///< set: the training under way ends soon, and is refused (not owned)
};

/// Ready to hand to run_study().
Trainer study_trainer(StudyTraining settings);

}  // namespace prism::analysis
