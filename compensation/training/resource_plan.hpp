// SPDX-License-Identifier: MIT
// How much memory and time a training takes, known before it begins.
#pragma once

#include <Eigen/Core>
#include <string>

#include "base/result.hpp"

namespace prism::training {

struct ResourcePlan {
  bool sparse = false;  ///< a low-rank model instead of one centre a sample
  Eigen::Index max_rank = 0;
  double bytes = 0, seconds = 0;  ///< seconds: a rough order on one core
  std::string text() const;
};

inline constexpr double kFlops = 4e9;  ///< of one core, a cautious guess

/// The plan itself. Errors: it needs more memory than the limit.
Result<ResourcePlan> within_memory(const ResourcePlan& plan, Eigen::Index samples, double limit_bytes);

/// A low-rank plan with as many centres as the memory holds, `most` at most. Errors: too few of them.
Result<ResourcePlan> plan_sparse(Eigen::Index samples, Eigen::Index inputs, double limit_bytes, Eigen::Index most);

}  // namespace prism::training
