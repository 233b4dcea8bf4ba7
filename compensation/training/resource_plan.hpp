// SPDX-License-Identifier: MIT
// Memory and time of a training, estimated before it starts.
#pragma once

#include <Eigen/Core>
#include <string>

#include "base/result.hpp"

namespace prism::training {

struct ResourcePlan {
  bool sparse = false;  ///< a low-rank model instead of one centre per sample
  Eigen::Index max_rank = 0;
  double bytes = 0, seconds = 0;  ///< seconds: rough estimate for one core
  std::string text() const;
};

inline constexpr double kFlops = 4e9;  ///< of one core, a conservative estimate

/// Returns the plan. Errors: it needs more memory than the limit.
Result<ResourcePlan> within_memory(const ResourcePlan& plan, Eigen::Index samples, double limit_bytes);

/// A low-rank plan with as many centres as fit in memory, at most `most`. Errors: too few centres fit.
Result<ResourcePlan> plan_sparse(Eigen::Index samples, Eigen::Index inputs, double limit_bytes, Eigen::Index most);

}  // namespace prism::training
