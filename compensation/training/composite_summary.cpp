// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include "compensation/composite_model.hpp"
#include "compensation/training/summary.hpp"

namespace prism::training {

// Variances in units of the target's variance.
MethodSummary describe_composite(const TrainedModel& trained, const TrainingSettings& settings,
                                 const std::vector<std::string>&) {
  const auto& p = static_cast<const compensation::CompositeModel&>(*trained.model).parameters();
  const compensation::CompositeVariances& v = p.variances;
  nlohmann::ordered_json json = {{"weight", weight_name(settings.reweight.weight.kind)}};
  json["variances"] = {{"smooth", v.kernel.rbf},
                       {"linear", v.kernel.linear},
                       {"quadratic", v.kernel.quadratic},
                       {"nuisance", v.nuisance},
                       {"nuisance_time_h", v.nuisance_time_h},
                       {"offset", v.offset},
                       {"noise", v.noise}};
  json["length_squared"] = std::vector<double>(v.kernel.length2.begin(), v.kernel.length2.end());
  json["skill"] = p.trust.skill;
  json["centres"] = trained.centres;
  json["reweighting"] = {{"solves", trained.reweight->solves}, {"converged", trained.reweight->converged}};
  std::string text = fmt::format(
      "  variances (of the target's): smooth {:.3g}, linear {:.3g}, quadratic {:.3g}, drift in time {:.3g} ({:.2g} h), "
      "noise {:.3g}\n  skill of each half on the other {:.2f}; {} centres, {} re-weightings\n",
      v.kernel.rbf, v.kernel.linear, v.kernel.quadratic, v.nuisance, v.nuisance_time_h, v.noise, p.trust.skill,
      trained.centres, trained.reweight->solves);
  return {std::move(json), std::move(text)};
}

}  // namespace prism::training
