// SPDX-License-Identifier: MIT
#include "compensation/training/resource_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace prism::training {
namespace {

constexpr Eigen::Index kMinRank = 50;

}  // namespace

std::string ResourcePlan::text() const {
  return fmt::format("{}, about {:.0f} MB and {:.1f} s",
                     sparse ? fmt::format("sparse model of at most {} centres", max_rank) : "one centre per sample",
                     std::ceil(bytes / 1e6), seconds);
}

Result<ResourcePlan> within_memory(const ResourcePlan& plan, Eigen::Index samples, double limit_bytes) {
  if (plan.bytes <= limit_bytes) return plan;
  return make_error("memory", fmt::format("{} samples need about {:.0f} MB, expected at most {:.0f} MB", samples,
                                          plan.bytes / 1e6, limit_bytes / 1e6));
}

Result<ResourcePlan> plan_sparse(Eigen::Index samples, Eigen::Index inputs, double limit_bytes, Eigen::Index most) {
  const double n = static_cast<double>(samples);
  const double fixed = n * 8 * static_cast<double>(inputs + 12);
  const double rank = (0.8 * limit_bytes - fixed) / (8 * n) - 2;
  ResourcePlan plan;
  plan.sparse = true;
  plan.max_rank = std::min<Eigen::Index>(most, static_cast<Eigen::Index>(rank));
  if (plan.max_rank < kMinRank) {
    return make_error(
        "memory",
        fmt::format("{} samples leave memory for {} centres within {:.0f} MB, expected at least {}: use fewer samples",
                    samples, std::max<Eigen::Index>(0, plan.max_rank), limit_bytes / 1e6, kMinRank));
  }
  const double r = static_cast<double>(plan.max_rank);
  plan.bytes = fixed + n * 8 * (r + 1) + 6 * 8 * r * r;
  plan.seconds = n * r * r * 25 / kFlops;
  return within_memory(plan, samples, limit_bytes);
}

}  // namespace prism::training
