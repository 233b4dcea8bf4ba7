// SPDX-License-Identifier: MIT
// How much memory and time a training takes, known before it begins.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "compensation/training/trainer.hpp"

namespace prism::training {
namespace {

constexpr Eigen::Index kDenseLimit = 5000;  // samples; beyond it one centre a sample would cost gigabytes and minutes
constexpr Eigen::Index kCompositeDenseLimit = 3000, kCompositeMaxRank = 400;
constexpr Eigen::Index kMaxRank = 600, kMinRank = 50;
constexpr double kFlops = 4e9;  // of one core, without luck

}  // namespace

std::string ResourcePlan::text() const {
  return fmt::format("{}, about {:.0f} MB and {:.1f} s",
                     sparse ? fmt::format("sparse model of at most {} centres", max_rank) : "one centre a sample",
                     std::ceil(bytes / 1e6), seconds);
}

Result<ResourcePlan> plan_resources(Eigen::Index samples, Eigen::Index inputs, const TrainingSettings& settings) {
  const double n = static_cast<double>(samples);
  ResourcePlan plan;
  if (settings.method == Method::kLeastSquares || settings.method == Method::kStepwise) {
    plan.bytes = n * 16 * static_cast<double>(settings.terms.size() + 2) * 2;
    return plan;
  }
  const bool composite = settings.method == Method::kComposite;
  plan.sparse = settings.method != Method::kSvr && samples > (composite ? kCompositeDenseLimit : kDenseLimit);
  if (!plan.sparse) {
    // Kernel, factor and inverse in double, the kernel once more in extended precision.
    plan.bytes = n * n * (3 * 8 + (n <= 4000 ? 16 : 0));
    const int solves = settings.reweight.weight.kind == WeightKind::kNone ? 2 : settings.reweight.limit == 1 ? 3 : 30;
    plan.seconds = n * n * n / 3 * solves / kFlops;
    if (composite) {
      plan.bytes = n * n * 5 * 8;  // covariance, its parts, the model's factor
      const double searched = std::min(n, 1000.0);
      plan.seconds = (searched * searched * searched * 60 + n * n * n / 3 * 15) / kFlops;
    }
    if (settings.method == Method::kSvr) plan = {false, 0, n * n * 4 + 200e6, n * n * 1e-7};
  } else {
    const double fixed = n * 8 * static_cast<double>(inputs + 12);
    const double rank = (0.8 * settings.memory_limit_bytes - fixed) / (8 * n) - 2;
    plan.max_rank = std::min<Eigen::Index>(composite ? kCompositeMaxRank : kMaxRank, static_cast<Eigen::Index>(rank));
    if (plan.max_rank < kMinRank) {
      return refuse(
          "memory",
          fmt::format(
              "{} samples leave room for {} centres within {:.0f} MB, expected at least {}: thin the record out",
              samples, std::max<Eigen::Index>(0, plan.max_rank), settings.memory_limit_bytes / 1e6, kMinRank));
    }
    const double r = static_cast<double>(plan.max_rank);
    plan.bytes = fixed + n * 8 * (r + 1) + 6 * 8 * r * r;
    plan.seconds = n * r * r * 25 / kFlops;
  }
  if (plan.bytes > settings.memory_limit_bytes) {
    return refuse("memory", fmt::format("{} samples need about {:.0f} MB, expected at most {:.0f} MB", samples,
                                        plan.bytes / 1e6, settings.memory_limit_bytes / 1e6));
  }
  return plan;
}

}  // namespace prism::training
